//! Files and folders on a file system that fails, and on one that does not.

use std::fs;
use std::io::Write;
use std::path::Path;

use serde_json::{Map, json};

use super::faults::{Fault, Kind, Tree, survive, tree, with};
use super::{FileError, Folder, MANIFEST, OutputFile, PROGRAM, publish, same_file};

fn write(path: &Path, content: &str, replace: bool) -> Result<(), FileError> {
    OutputFile::claim(path, replace)?.write(|file| file.write_all(content.as_bytes()))
}

/// Two files in one folder, one of them nested, and the manifest.
fn fill(path: &Path, content: &str, replace: bool) -> Result<(), FileError> {
    let folder = Folder::claim(path, replace)?;
    folder.write("a.txt", content.as_bytes())?;
    let target = folder.file("data/b.txt")?;
    target.write(|file| file.write_all(content.as_bytes()))?;
    let mut manifest = Map::new();
    manifest.insert("program".into(), json!(PROGRAM));
    folder.finish(manifest)
}

#[test]
fn a_file_appears_only_when_it_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rows.csv");
    let target = OutputFile::claim(&path, false).unwrap();
    assert!(tree(folder.path()).contains_key("/"), "claiming leaves nothing");
    let failure = target.write(|file| {
        file.write_all(b"half")?;
        Err(std::io::Error::other("disk full"))
    });
    assert!(failure.unwrap_err().to_string().contains("disk full"));
    assert!(tree(folder.path()).contains_key("/"), "and so does failing");
    write(&path, "whole", false).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"whole");
}

#[test]
fn an_existing_file_is_replaced_only_where_that_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rows.csv");
    let early = OutputFile::claim(&path, false).unwrap();
    fs::write(&path, "mine").unwrap();
    let exists = FileError::Exists(path.clone());
    assert_eq!(OutputFile::claim(&path, false).unwrap_err(), exists);
    // One that appears during the run is not lost either.
    assert_eq!(early.write(|file| file.write_all(b"new")), Err(exists));
    assert_eq!(fs::read(&path).unwrap(), b"mine");
    write(&path, "new", true).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
}

#[test]
fn an_unwritable_place_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for bad in ["no/such/folder/rows.csv", "", ".", ".."] {
        assert!(OutputFile::claim(&folder.path().join(bad), true).is_err(), "{bad}");
    }
    #[cfg(unix)]
    assert!(OutputFile::claim(Path::new("/dev/null"), true).is_err());
}

#[test]
fn a_file_that_fails_leaves_everything_as_it_was() {
    let old = |folder: &Path| fs::write(folder.join("a"), "old").unwrap();
    let work = |folder: &Path| write(&folder.join("a"), "new", true).map_err(|e| e.to_string());
    let whole = |old: &Tree, new: &Tree, found: &Tree| found == old || found == new;
    survive(Kind::default(), &old, &work, &whole);
    let two = |folder: &Path| {
        let fill = |name: &str| {
            let target = OutputFile::claim(&folder.join(name), true)?;
            target.fill(|file| file.write_all(b"new"))
        };
        publish(vec![fill("b")?, fill("a")?])
    };
    // After a kill one of the two may be there, never part of one.
    let each = |old: &Tree, new: &Tree, found: &Tree| {
        let known = |(name, content)| old.get(name) == Some(content) || new.get(name) == Some(content);
        found.iter().all(known)
    };
    survive(Kind::default(), &old, &|f| two(f).map_err(|e| e.to_string()), &each);
}

#[test]
fn a_folder_that_fails_leaves_the_old_or_the_new() {
    let whole = |old: &Tree, new: &Tree, found: &Tree| found == old || found == new;
    let new = |folder: &Path| fill(&folder.join("out"), "new", true).map_err(|e| e.to_string());
    let old = |folder: &Path| fill(&folder.join("out"), "old", false).unwrap();
    survive(Kind::default(), &|_| (), &new, &whole);
    survive(Kind::default(), &|folder| fs::create_dir(folder.join("out")).unwrap(), &new, &|old, new, found| {
        whole(old, new, found)
    });
    survive(Kind::default(), &old, &new, &whole);
    // Where names cannot be swapped, a kill may leave neither; the next run brings the old one back.
    let kind = Kind { no_exchange: true, ..Kind::default() };
    survive(kind, &old, &new, &|old, new, found| found.is_empty() || whole(old, new, found));
}

#[test]
fn a_folder_replaces_what_this_program_wrote_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    fill(&out, "1", false).unwrap();
    assert_eq!(fill(&out, "2", false), Err(FileError::NotEmpty(out.clone())));
    fill(&out, "2", true).unwrap();
    assert_eq!(fs::read(out.join("a.txt")).unwrap(), b"2");
    // Foreign files are named and left alone, whenever they appeared.
    let early = Folder::claim(&out, true).unwrap();
    fs::create_dir_all(out.join("data/notes")).unwrap();
    fs::write(out.join("film.mp4"), "x").unwrap();
    let before = tree(&out);
    for error in [early.finish(Map::new()).unwrap_err(), fill(&out, "3", true).unwrap_err()] {
        let text = error.to_string();
        assert!(text.contains("(data/notes, film.mp4)"), "{text}");
    }
    assert_eq!(tree(&out), before);
    for (name, content) in [("no", ""), (MANIFEST, "{\"name\": \"a web application\"}")] {
        let photos = folder.path().join(format!("photos-{name}"));
        fs::create_dir(&photos).unwrap();
        fs::write(photos.join("holiday.png"), "x").unwrap();
        fs::write(photos.join(name), content).unwrap();
        let text = Folder::claim(&photos, true).unwrap_err().to_string();
        assert!(text.contains("holiday.png"), "{text}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3, "nothing is left beside");
}

#[test]
fn a_folder_that_cannot_get_its_name_is_refused_before_the_work() {
    let refused = |path: &Path, why: &str| {
        let text = Folder::claim(path, true).unwrap_err().to_string();
        assert!(text.contains(why), "{text}");
    };
    refused(Path::new("."), "the command runs in it");
    refused(Path::new(".."), "the command runs in it");
    refused(Path::new("no/such/out"), "cannot write no/such/out");
    refused(Path::new(file!()), "not a folder");
    #[cfg(target_os = "linux")]
    refused(Path::new("/proc"), "mounted");
}

#[cfg(unix)]
#[test]
fn links_are_followed() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("disk")).unwrap();
    symlink("disk/out", at("out")).unwrap();
    fill(&at("out/"), "1", false).unwrap();
    fill(&at("out"), "2", true).unwrap();
    assert_eq!(fs::read(at("disk/out/a.txt")).unwrap(), b"2");
    symlink("disk/rows", at("rows")).unwrap();
    assert!(write(&at("rows"), "1", false).is_err(), "a link is something");
    write(&at("rows"), "1", true).unwrap();
    assert_eq!(fs::read(at("disk/rows")).unwrap(), b"1");
    assert!(fs::symlink_metadata(at("out")).unwrap().is_symlink());
    assert!(fs::symlink_metadata(at("rows")).unwrap().is_symlink());
    symlink("round", at("round")).unwrap();
    assert!(write(&at("round"), "1", true).is_err() && fill(&at("round"), "1", true).is_err());
    assert_eq!(fs::read_dir(at("disk")).unwrap().count(), 2, "nothing is left beside");
}

#[test]
fn one_file_is_one_under_all_its_names() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("sub")).unwrap();
    let same = |a: &str, b: &str| same_file(&at(a), &[&at("other.csv"), &at(b)]) == Some(1);
    assert!(same("x.csv", "x.csv") && same("x.csv", "./x.csv") && same("x.csv", "sub/../x.csv"));
    assert!(!same("x.csv", "y.csv") && !same("x.csv", "sub/x.csv") && !same("x.csv", "no/x.csv"));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("x.csv", at("link.csv")).unwrap();
        std::os::unix::fs::symlink(".", at("here")).unwrap();
        assert!(same("x.csv", "link.csv") && same("x.csv", "here/x.csv"));
    }
    assert_eq!(same("x.csv", "X.csv"), cfg!(any(windows, target_os = "macos")));
    let folds = Kind { folds_case: true, ..Kind::default() };
    assert!(with(Fault::None, folds, || same("x.csv", "./X.CSV")).0);
    assert!(!with(Fault::None, folds, || same("x.csv", "xx.csv")).0);
    assert!(!tree(folder.path()).keys().any(|name| name.starts_with('.')));
}

#[test]
fn scratch_of_a_killed_run_goes_and_that_of_a_live_one_stays() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let live = Folder::claim(&at("live"), false).unwrap();
    let filled = OutputFile::claim(&at("b"), false).unwrap().fill(|file| file.write_all(b"b")).unwrap();
    // From another machine, or not ours.
    let names = [".jointplay-00000000-00000000-0123456789abcdef", ".jointplay-notes", ".other"];
    names.iter().for_each(|name| fs::write(at(name), "x").unwrap());
    let count = || fs::read_dir(folder.path()).unwrap().count();
    let before = count();
    let _ = with(Fault::Kills(3), Kind::default(), || write(&at("a"), "a", false));
    let _ = with(Fault::Kills(9), Kind::default(), || fill(&at("c"), "c", false));
    assert!(count() > before, "{:?}", tree(folder.path()).keys());
    write(&at("d"), "d", false).unwrap();
    assert_eq!(count(), before + 1, "{:?}", tree(folder.path()).keys());
    live.finish(Map::new()).unwrap();
    publish(vec![filled]).unwrap();
    assert!(at("live").join(MANIFEST).is_file() && at("b").is_file());
    names.iter().for_each(|name| assert!(at(name).is_file()));
}
