//! A file system that fails where a test says so, for the thread that requests it and the files it opens.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex};

use super::call::Call;

/// What goes wrong.
#[derive(Clone, Copy, Debug)]
pub enum Fault {
    /// Nothing: calls are counted.
    None,
    /// The n-th call of a kind, from 1, finds the disk full.
    Fails(Call, usize),
    /// The program is killed at the n-th call, from 1: neither this call nor any later one has an effect.
    Kills(usize),
}

/// Properties of the file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct Kind {
    /// Whether it cannot swap two names.
    pub no_exchange: bool,
    /// Whether `a` and `A` are one name.
    pub folds_case: bool,
}

#[derive(Debug, Default)]
struct State {
    counts: BTreeMap<Call, usize>,
    total: usize,
    dead: bool,
    /// Whether the write that just failed leaves its beginning.
    torn: bool,
}

/// See [`super::disk`].
#[derive(Clone, Debug, Default)]
pub struct Gate(Option<Arc<(Fault, Kind, Mutex<State>)>>);

thread_local! {
    static HERE: RefCell<Gate> = const { RefCell::new(Gate(None)) };
}

impl Gate {
    /// The gate of this thread.
    pub fn here() -> Self {
        HERE.with_borrow(Clone::clone)
    }

    /// Lets a call pass, or makes it fail.
    pub fn pass(&self, call: Call) -> io::Result<()> {
        let Some((fault, kind, state)) = self.0.as_deref() else {
            return Ok(());
        };
        let mut state = state.lock().unwrap();
        if state.dead {
            return Err(io::Error::other("killed"));
        }
        let count = state.counts.entry(call).or_default();
        *count += 1;
        let nth = *count;
        state.total += 1;
        match *fault {
            Fault::Fails(wanted, n) if wanted == call && n == nth => {
                state.torn = true;
                Err(io::ErrorKind::StorageFull.into())
            }
            Fault::Kills(n) if n == state.total => {
                (state.dead, state.torn) = (true, true);
                Err(io::Error::other("killed"))
            }
            _ if call == Call::Exchange && kind.no_exchange => Err(io::ErrorKind::Unsupported.into()),
            _ => Ok(()),
        }
    }

    /// The part of `bytes` that a failing write still writes: half on a full disk and at the kill, nothing after it.
    pub(super) fn torn<'a>(&self, bytes: &'a [u8]) -> &'a [u8] {
        let state = self.0.as_deref().map(|(_, _, state)| state);
        let torn = state.is_some_and(|state| std::mem::take(&mut state.lock().unwrap().torn));
        &bytes[..if torn { bytes.len() / 2 } else { 0 }]
    }

    /// Whether `path` exists under another spelling of its name.
    pub(super) fn folded(&self, path: &Path) -> bool {
        let folds = self.0.as_deref().is_some_and(|(_, kind, _)| kind.folds_case);
        let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
            return false;
        };
        let alike = |other: &std::ffi::OsStr| other.eq_ignore_ascii_case(name);
        folds && std::fs::read_dir(folder).is_ok_and(|mut all| all.any(|e| e.is_ok_and(|e| alike(&e.file_name()))))
    }
}

/// Runs `work` on such a file system; also returns the number of calls of each kind.
pub fn with<T>(fault: Fault, kind: Kind, work: impl FnOnce() -> T) -> (T, BTreeMap<Call, usize>) {
    let gate = Gate(Some(Arc::new((fault, kind, Mutex::default()))));
    HERE.replace(gate.clone());
    let result = work();
    HERE.take();
    let counts = gate.0.map(|plan| plan.2.lock().unwrap().counts.clone());
    (result, counts.unwrap_or_default())
}

/// Every file under `folder` with its content, and every empty folder.
pub fn tree(folder: &Path) -> Tree {
    let mut all = Tree::new();
    let mut todo = vec![folder.to_owned()];
    while let Some(path) = todo.pop() {
        let entries: Vec<_> = std::fs::read_dir(&path).unwrap().collect();
        if entries.is_empty() {
            all.insert(format!("{}/", relative(folder, &path)), Vec::new());
        }
        for entry in entries {
            let entry = entry.unwrap();
            let path = entry.path();
            if entry.file_type().unwrap().is_dir() {
                todo.push(path);
            } else {
                // Nothing is read through a dangling link.
                let content = std::fs::read(&path).unwrap_or_default();
                all.insert(relative(folder, &path), content);
            }
        }
    }
    all
}

fn relative(folder: &Path, path: &Path) -> String {
    let path = path.strip_prefix(folder).unwrap();
    path.display().to_string()
}

/// What users see of `tree`: no scratch, nothing that a later run resumes from.
fn results(tree: &Tree) -> Tree {
    let mut results = tree.clone();
    results.retain(|name, _| !name.starts_with(".jointplay-") && !name.ends_with(".partial") && name != "/");
    results
}

/// Number of faults per case; the environment may ask for more.
fn most() -> usize {
    let asked = std::env::var("JOINTPLAY_FAULTS").ok();
    asked.and_then(|number| number.parse().ok()).unwrap_or(24)
}

/// Some of 1..=`count`, including both ends.
fn some(count: usize, most: usize) -> Vec<usize> {
    let mut all: Vec<usize> =
        (0..most.min(count)).map(|k| 1 + k * (count - 1) / (most.min(count) - 1).max(1)).collect();
    all.dedup();
    all
}

/// Runs `work` with faults in a folder prepared by `before`: it leaves what was there or its whole result, never anything
/// between, and nothing else; repeating it then gives the result of a run without faults. After a kill `may_be` decides
/// which mixtures of old, new and present results are right.
pub fn survive(
    kind: Kind,
    before: &dyn Fn(&Path),
    work: &dyn Fn(&Path) -> Result<(), String>,
    may_be: &dyn Fn(&Tree, &Tree, &Tree) -> bool,
) {
    let start = || {
        let folder = tempfile::tempdir().unwrap();
        before(folder.path());
        folder
    };
    let clean = start();
    let old = tree(clean.path());
    let (result, counts) = with(Fault::None, kind, || work(clean.path()));
    result.unwrap();
    let new = tree(clean.path());
    assert!(old != new && new == results(&new), "{:?}", new.keys());
    let total: usize = counts.values().sum();
    let share = |count: usize| (most() * count / total).max(2);
    for (&call, &count) in &counts {
        for n in some(count, share(count)) {
            let folder = start();
            let (result, _) = with(Fault::Fails(call, n), kind, || work(folder.path()));
            let what = format!("{call:?} {n} of {count}: {result:?}");
            let found = tree(folder.path());
            if call != Call::Remove {
                let resumable = |name: &String| name.ends_with(".partial") || name == "/";
                let stray = found.keys().find(|k| !old.contains_key(*k) && !new.contains_key(*k));
                assert!(stray.is_none_or(resumable), "{what} left {stray:?}");
            }
            if result.is_ok() {
                assert!(results(&found) == new, "{what}: {:?}", found.keys());
                continue;
            }
            assert!(results(&found) == results(&old), "{what}: {:?}", found.keys());
            work(folder.path()).unwrap_or_else(|again| panic!("{what}, then {again}"));
            assert!(tree(folder.path()) == new, "{what}, then {:?}", tree(folder.path()).keys());
        }
    }
    for n in some(total, most()) {
        let folder = start();
        let (result, _) = with(Fault::Kills(n), kind, || work(folder.path()));
        let found = results(&tree(folder.path()));
        let what = format!("killed at {n} of {total}: {result:?}, {:?}", found.keys());
        assert!(may_be(&results(&old), &new, &found), "{what}");
        let again = with(Fault::None, kind, || work(folder.path())).0;
        let after = tree(folder.path());
        // Without --force existing results are refused.
        if again.is_err() {
            let known = |name: &String| new.contains_key(name) && !old.contains_key(name);
            let same = results(&after) == found && found.keys().any(known);
            assert!(same, "{what}, then {again:?}");
        } else {
            assert!(after == new, "{what}, then {:?}", after.keys());
        }
        assert!(!after.keys().any(|name| name.contains(".jointplay-")), "{what}");
    }
}

/// Files by their names.
pub type Tree = BTreeMap<String, Vec<u8>>;
