use std::fs;
use std::io::Write;
use std::path::Path;

use serde_json::{Map, json};
use tempfile::tempdir;

use super::temporary::{self, OLD};
use super::{FileError, Folder, MANIFEST, OutputFile, PROGRAM, publish, same_file};

fn write(path: &Path, content: &str, replace: bool) -> Result<(), FileError> {
    OutputFile::claim(path, replace)?.write(|file| file.write_all(content.as_bytes()))
}

/// Two files in one folder, one of them nested, and the manifest.
fn fill(path: &Path, content: &str, replace: bool) -> Result<(), FileError> {
    let folder = Folder::claim(path, replace)?;
    folder.write("a.txt", content.as_bytes())?;
    folder.file("data/b.txt")?.write(|file| file.write_all(content.as_bytes()))?;
    let mut manifest = Map::new();
    manifest.insert("program".into(), json!(PROGRAM));
    folder.finish(manifest)
}

fn count(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

#[test]
fn a_file_appears_only_when_complete() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("rows.csv");
    let target = OutputFile::claim(&path, false).unwrap();
    assert_eq!(count(folder.path()), 0, "claiming leaves nothing");
    let failure = target.write(|file| {
        file.write_all(b"half")?;
        Err(std::io::Error::other("disk full"))
    });
    assert!(failure.unwrap_err().to_string().contains("disk full"));
    assert_eq!(count(folder.path()), 0, "and so does failing");
    write(&path, "whole", false).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"whole");
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        fs::write(folder.path().join("other"), "").unwrap();
        let mode = |name: &str| fs::metadata(folder.path().join(name)).unwrap().mode();
        assert_eq!(mode("rows.csv"), mode("other"), "readable as any other file");
    }
}

#[test]
fn an_existing_file_is_replaced_only_where_that_is_allowed() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("rows.csv");
    let early = OutputFile::claim(&path, false).unwrap();
    fs::write(&path, "mine").unwrap();
    let exists = FileError::Exists(path.clone());
    assert_eq!(OutputFile::claim(&path, false).unwrap_err(), exists);
    // A file that appears during the run is not overwritten either.
    assert_eq!(early.write(|file| file.write_all(b"new")), Err(exists));
    assert_eq!(fs::read(&path).unwrap(), b"mine");
    write(&path, "new", true).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
}

#[test]
fn an_unwritable_place_is_refused_at_once() {
    let folder = tempdir().unwrap();
    for bad in ["no/such/folder/rows.csv", "", ".", ".."] {
        assert!(OutputFile::claim(&folder.path().join(bad), true).is_err(), "{bad}");
    }
    #[cfg(unix)]
    assert!(OutputFile::claim(Path::new("/dev/null"), true).is_err());
    for (bad, why) in [
        (".", "the command runs in it"),
        ("..", "the command runs in it"),
        ("no/such/out", "cannot write no/such/out"),
        (file!(), "not a folder"),
    ] {
        let text = Folder::claim(Path::new(bad), true).unwrap_err().to_string();
        assert!(text.contains(why), "{text}");
    }
}

#[test]
fn a_folder_replaces_what_this_program_wrote_and_nothing_else() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    fill(&out, "1", false).unwrap();
    assert_eq!(fill(&out, "2", false), Err(FileError::NotEmpty(out.clone())));
    fill(&out, "2", true).unwrap();
    assert_eq!(fs::read(out.join("a.txt")).unwrap(), b"2");
    // Foreign files are named and left alone, whenever they appeared.
    let early = Folder::claim(&out, true).unwrap();
    fs::create_dir_all(out.join("data/notes")).unwrap();
    fs::write(out.join("film.mp4"), "x").unwrap();
    for error in [early.finish(Map::new()).unwrap_err(), fill(&out, "3", true).unwrap_err()] {
        let text = error.to_string();
        assert!(text.contains("(data/notes, film.mp4)"), "{text}");
        assert_eq!((count(&out), fs::read(out.join("data/b.txt")).unwrap()), (4, b"2".to_vec()));
    }
    for (name, content) in [("no", ""), (MANIFEST, "{\"name\": \"a web application\"}")] {
        let photos = folder.path().join(format!("photos-{name}"));
        fs::create_dir(&photos).unwrap();
        fs::write(photos.join("holiday.png"), "x").unwrap();
        fs::write(photos.join(name), content).unwrap();
        let text = Folder::claim(&photos, true).unwrap_err().to_string();
        assert!(text.contains("holiday.png"), "{text}");
    }
    assert_eq!(count(folder.path()), 3, "nothing is left beside");
}

#[cfg(unix)]
#[test]
fn links_are_followed() {
    use std::os::unix::fs::symlink;
    let folder = tempdir().unwrap();
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
    assert_eq!(count(&at("disk")), 2, "nothing is left beside");
}

#[test]
fn different_names_of_one_file_are_recognised() {
    let folder = tempdir().unwrap();
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
    assert!(
        !fs::read_dir(folder.path()).unwrap().any(|it| it.unwrap().file_name().display().to_string().starts_with('.'))
    );
}

#[cfg(unix)]
#[test]
fn leftovers_of_a_killed_run_are_removed_and_those_of_a_live_run_stay() {
    let folder = tempdir().unwrap();
    let [a, out] = ["a", "out"].map(|name| folder.path().canonicalize().unwrap().join(name));
    let pending = OutputFile::claim(&a, true).unwrap().fill(|file| file.write_all(b"live")).unwrap();
    let live = Folder::claim(&out, false).unwrap();
    // A file of another target, or of another program.
    fs::write(folder.path().join(".jointplay-00000000-012345"), "x").unwrap();
    let before = count(folder.path());
    // A killed process releases its lock and removes nothing.
    let _ = temporary::file(&a).unwrap().keep().unwrap();
    let left = temporary::folder(&out).unwrap().0.keep();
    fs::write(left.join("half"), "x").unwrap();
    assert_eq!(count(folder.path()), before + 2);
    drop((OutputFile::claim(&a, false).unwrap(), Folder::claim(&out, false).unwrap()));
    assert_eq!(count(folder.path()), before);
    live.finish(Map::new()).unwrap();
    publish(vec![pending]).unwrap();
    assert!(out.join(MANIFEST).is_file() && a.is_file());
}

#[cfg(unix)]
#[test]
fn a_folder_that_a_killed_run_was_replacing_is_restored() {
    let folder = tempdir().unwrap();
    let out = folder.path().join("out");
    fill(&out, "old", false).unwrap();
    let left = temporary::folder(&out).unwrap().0.keep();
    fs::rename(&out, left.join(OLD)).unwrap();
    assert_eq!(fill(&out, "new", false), Err(FileError::NotEmpty(out.clone())));
    assert_eq!(fs::read(out.join("a.txt")).unwrap(), b"old");
    assert_eq!(count(folder.path()), 1);
}
