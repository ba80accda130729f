//! `reproduce`: the report is complete, its page agrees with its data, and threads change nothing.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use jointplay::analysis::paper::PAPER;
use jointplay::cli::output::significant;

use crate::program::{Outcome, command, jointplay};

/// Every file under `folder` with its content.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn walk(root: &Path, folder: &Path, out: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(root, &path, out);
            } else {
                let name = path.strip_prefix(root).unwrap().display().to_string();
                out.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    let mut out = BTreeMap::new();
    walk(folder, folder, &mut out);
    out
}

/// A number as written on the page without a power of ten.
fn page_number(value: f64) -> String {
    let text = significant(value, 4);
    assert!(!text.contains('e'), "{text}");
    text
}

/// Cells of all table rows of the page without tags.
fn rows(page: &str) -> Vec<Vec<String>> {
    let plain = |cell: &str| {
        let mut text = String::new();
        let mut inside = false;
        for c in cell.chars() {
            match c {
                '<' => inside = true,
                '>' => inside = false,
                c if !inside => text.push(c),
                _ => {}
            }
        }
        text
    };
    page.split("<tr>")
        .skip(1)
        .map(|row| {
            let row = row.split("</tr>").next().unwrap();
            row.split("</td>").map(plain).filter(|cell| !cell.is_empty()).collect()
        })
        .collect()
}

/// The quick report in `report/` of a folder, made once and shared by the tests: it was interrupted after some blocks, damaged,
/// repaired, and resumed with another number of threads.
fn quick_report() -> &'static (tempfile::TempDir, Outcome) {
    static REPORT: OnceLock<(tempfile::TempDir, Outcome)> = OnceLock::new();
    REPORT.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        #[cfg(unix)]
        interrupt(folder.path());
        let run = jointplay(folder.path(), "reproduce --out report --quick --threads 2");
        (folder, run)
    })
}

#[cfg(unix)]
#[test]
#[ignore = "long: half a minute for the report"]
fn long_ctrl_c_leaves_no_incomplete_report_and_the_same_command_resumes() {
    let (folder, run) = quick_report();
    assert!(run.stderr.contains("resuming where report.partial stopped"), "{}", run.stderr);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing but the report is left");
}

#[test]
#[ignore = "long: half a minute for the report"]
fn long_a_quick_report_is_complete_and_its_page_agrees_with_its_data() {
    let (folder, run) = quick_report();
    assert_eq!(run.code, Some(0), "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("Statements") && run.stdout.contains("report/index.html"));
    let all = files(&folder.path().join("report"));
    let page = String::from_utf8(all["index.html"].clone()).unwrap();

    // The manifest lists every other file; every figure of the paper exists in two formats and on the page.
    let manifest: serde_json::Value = serde_json::from_slice(&all["manifest.json"]).unwrap();
    let named: Vec<&str> = manifest["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
    let present: Vec<&str> = all.keys().map(String::as_str).filter(|name| *name != "manifest.json").collect();
    assert_eq!(named, present);
    for figure in 5..=23 {
        let name = format!("figure-{figure:02}");
        for ending in ["svg", "png"] {
            assert!(all.contains_key(&format!("plots/{name}.{ending}")), "{name}.{ending}");
        }
        assert!(page.contains(&format!("<h3 id=\"{name}\">Figure {figure}:")), "{name}");
    }
    assert_eq!(page.matches("<svg ").count(), all.keys().filter(|n| n.ends_with(".svg")).count());

    // The page is self-contained, and all its links resolve.
    for outside in ["http://", "https://", "<script", "src=", "@import", "<link"] {
        let without_namespace = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!without_namespace.contains(outside), "{outside}");
    }
    for link in page.split("href=\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
        let exists = match link.strip_prefix('#') {
            Some(id) => page.contains(&format!("id=\"{id}\"")),
            None => all.contains_key(link),
        };
        assert!(exists, "{link}");
    }
    assert!(page.len() < 5_000_000, "{}", page.len());
    assert!(!page.contains("NaN"), "a number is missing");

    // Every number printed in the paper has a row that agrees with the data.
    let text = String::from_utf8(all["data/numbers.csv"].clone()).unwrap();
    let table = rows(&page);
    let lines: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), PAPER.numbers.len());
    for (line, published) in lines.iter().zip(&PAPER.numbers) {
        let number = |k: usize| line[k].parse::<f64>().unwrap();
        assert_eq!((line[0], number(5)), (&published.figure[..], published.value));
        let full = number(6);
        assert!((full / number(5) - number(8)).abs() < 1e-9);
        let run = format!("{} mm, {}", published.case.clearance, published.case.friction);
        let quantity = format!("{} ({})", line[3].replace("beta", "β"), line[4]);
        let row = table.iter().find(|row| row.len() == 9 && row[0] == line[0] && row[1] == run && row[2] == quantity);
        let row = row.unwrap_or_else(|| panic!("no row for {line:?}"));
        assert_eq!(row[3], page_number(published.value));
        assert_eq!(row[4], page_number(full));
        if !line[7].is_empty() {
            assert_eq!(row[6], page_number(number(7)));
            assert!(number(7) <= full * (1.0 + 1e-9), "samples exceed continuous time: {line:?}");
        }
        let word = if (0.9..=1.1).contains(&number(8)) {
            "agrees within 10 %"
        } else if (0.5..=2.0).contains(&number(8)) {
            "within a factor of 2"
        } else {
            "differs"
        };
        assert_eq!((row[8].as_str(), line[10]), (word, word));
    }
    // The first peak of the nominal run agrees with the reference solution (`tests/physics/reference.rs`).
    let velocity = lines.iter().find(|line| line[0] == "6a").unwrap();
    assert!((velocity[7].parse::<f64>().unwrap() / 0.147 - 1.0).abs() < 0.01, "{velocity:?}");

    // Every statement is on the page with its verdict; there are some of either kind.
    let statements = String::from_utf8(all["data/statements.csv"].clone()).unwrap();
    let confirmed = statements.lines().filter(|l| l.contains(",confirmed,")).count();
    let refuted = statements.lines().filter(|l| l.contains(",not confirmed,")).count();
    assert_eq!(confirmed + refuted, statements.lines().count() - 1);
    assert!(confirmed > 10 && refuted > 5, "{confirmed} {refuted}");
    assert_eq!(page.matches("<span class=\"ok\">confirmed</span>").count(), confirmed);
    assert_eq!(page.matches("<span class=\"off\">not confirmed</span>").count(), refuted);
    assert!(page.contains(&format!("<b>{confirmed} of {}</b>", confirmed + refuted)));

    // The page states that it is a quick report; numbers and names are typeset.
    assert!(page.contains("This is a quick report"), "no notice");
    assert!(!page.contains("beta"), "β has one name on the page");
    let power = |c: &[char]| c[0].is_ascii_digit() && c[1] == 'e' && (c[2] == '-' || c[2].is_ascii_digit());
    for row in &table {
        for cell in row {
            let letters: Vec<char> = cell.chars().collect();
            assert!(!letters.windows(3).any(power), "{cell}");
        }
    }

    // A report is not overwritten without --force, and --force does not replace other folders.
    let refused = jointplay(folder.path(), "reproduce --out report --quick --quiet");
    assert_eq!(refused.code, Some(1), "{}", refused.stderr);
    assert!(refused.stderr.contains("--force"), "{}", refused.stderr);
    assert_eq!(all, files(&folder.path().join("report")));
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("other")).unwrap();
    fs::write(folder.path().join("other/mine.txt"), "mine").unwrap();
    let other = jointplay(folder.path(), "reproduce --out other --quick --force");
    assert_eq!(other.code, Some(1), "{}", other.stderr);
    assert!(folder.path().join("other/mine.txt").exists());
}

#[test]
fn invalid_input_is_refused_before_anything_runs() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "x").unwrap();
    for (line, code, fragment) in [
        ("reproduce --out file", 1, "it is a file"),
        ("reproduce --out no/such/report", 1, "cannot write"),
        ("reproduce", 2, "--out"),
        ("reproduce --out report --threads 0", 2, "threads"),
        ("reproduce --out report spcmm", 2, "spcmm"),
    ] {
        let outcome = jointplay(folder.path(), line);
        assert_eq!(outcome.code, Some(code), "{line}: {}", outcome.stderr);
        assert!(outcome.stderr.contains(fragment), "{line}: {}", outcome.stderr);
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left");
}

/// Interrupts a report in `folder`: it leaves only a partial file, which is refused if damaged or begun with other settings.
#[cfg(unix)]
fn interrupt(folder: &Path) {
    let entries = || files(folder);
    let line = "reproduce --out report/ --quick --threads 1";
    let mut child = command(folder, line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Waits until some blocks are written.
    let length = || -> usize {
        let part = |name: &str| fs::read(folder.join("report.partial").join(name)).map_or(0, |b| b.len());
        part("runs_by_clearance.partial") + part("runs_by_friction.partial")
    };
    let mut lengths = Vec::new();
    while lengths.len() < 5 {
        let now = length();
        if lengths.last() != Some(&now) {
            lengths.push(now);
        }
        assert!(child.try_wait().unwrap().is_none(), "finished before the interrupt");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.unwrap().success());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("no report was written") && stderr.contains("resumes from report.partial"), "{stderr}");
    assert!(output.stdout.is_empty());
    let left = entries();
    assert!(left.keys().all(|name| name.starts_with("report.partial/")), "{:?}", left.keys());

    let first = folder.join("report.partial/runs_by_clearance.partial");
    let intact = fs::read(&first).unwrap();
    let mut damage = intact.clone();
    damage[intact.len() / 2] ^= 1;
    fs::write(&first, &damage).unwrap();
    let damaged = jointplay(folder, "reproduce --out report --quick");
    assert_eq!(damaged.code, Some(1), "{}", damaged.stderr);
    assert!(damaged.stderr.contains("report.partial/runs_by_clearance.partial is damaged"), "{}", damaged.stderr);
    fs::write(&first, &intact).unwrap();
    let other = jointplay(folder, "reproduce --out report");
    assert_eq!(other.code, Some(2), "{}", other.stderr);
    assert!(other.stderr.contains("started with other settings"), "{}", other.stderr);
    assert!(entries() == left, "the partial report is unchanged");
}

#[cfg(unix)]
#[test]
#[ignore = "long: a minute"]
fn long_neither_interruptions_nor_threads_change_a_byte_of_the_report() {
    let folder = tempfile::tempdir().unwrap();
    jointplay(folder.path(), "reproduce --out report --quick --quiet --threads 1").expect(0);
    let (one, other) = (files(&folder.path().join("report")), files(&quick_report().0.path().join("report")));
    assert!(one.keys().eq(other.keys()));
    for (name, content) in &one {
        assert!(*content == other[name], "{name} differs");
    }
}
