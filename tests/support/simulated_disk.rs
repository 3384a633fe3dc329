//! A file system in memory that forgets, at a crash, what was not synced, and fails on demand.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard};

use mrol_store::{Appending, FileSystem};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SECTOR_BYTES: usize = 512;

/// What goes wrong, at which of the operations that change something (0 is the first).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The operation fails, and has no effect.
    Fails(usize),
    /// An append leaves a part of its bytes, as where there is no space left; anything else fails.
    FallsShort(usize),
    /// The power goes: this operation and all after it fail.
    Crash(usize),
    /// There is no space left: files can be made, and have half of what is first written to them.
    Full,
}

/// A handle; clones are the same file system.
#[derive(Debug, Clone, Default)]
pub struct SimulatedDisk(Arc<Mutex<State>>);

#[derive(Debug, Clone)]
enum Node {
    File { bytes: Vec<u8>, durable: Vec<u8> },
    Folder { names: Names, durable: Names },
}

type Names = BTreeMap<String, usize>;

#[derive(Debug, Clone)]
struct State {
    nodes: Vec<Node>,
    fault: Option<Fault>,
    operations: usize,
}

impl Default for State {
    fn default() -> Self {
        let root = Node::Folder { names: Names::new(), durable: Names::new() };
        Self { nodes: vec![root], fault: None, operations: 0 }
    }
}

impl SimulatedDisk {
    /// From now on, counting from here.
    pub fn set_fault(&self, fault: Option<Fault>) {
        let mut state = self.state();
        (state.fault, state.operations) = (fault, 0);
    }

    /// Operations since the fault was set.
    pub fn operations(&self) -> usize {
        self.state().operations
    }

    /// What is there after the power went and came back. What was synced is there; of the rest, whatever the
    /// disk happened to have written: nothing, a beginning, or some sectors.
    pub fn after_crash(&self, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut state = self.state().clone();
        for node in &mut state.nodes {
            match node {
                Node::File { bytes, durable } => {
                    *bytes = survivors(bytes, durable, &mut rng);
                    durable.clone_from(bytes);
                }
                Node::Folder { names, durable } => {
                    if rng.random_bool(0.7) {
                        names.clone_from(durable);
                    }
                    durable.clone_from(names);
                }
            }
        }
        state.fault = None;
        Self(Arc::new(Mutex::new(state)))
    }

    /// The same files with the bit `bit` of the byte `at` of `path` flipped.
    pub fn with_flipped_bit(&self, path: &Path, at: usize, bit: u32) -> Self {
        let mut state = self.state().clone();
        let id = state.find(path).expect("a file");
        if let Node::File { bytes, .. } = &mut state.nodes[id] {
            bytes[at] ^= 1 << bit;
        }
        Self(Arc::new(Mutex::new(state)))
    }

    /// An independent copy.
    pub fn copy(&self) -> Self {
        Self(Arc::new(Mutex::new(self.state().clone())))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().expect("no panic while it was locked")
    }

    fn change<T>(&self, change: impl FnOnce(&mut State) -> io::Result<T>) -> io::Result<T> {
        let mut state = self.state();
        state.operation()?;
        change(&mut state)
    }
}

/// What a crash leaves of a file.
fn survivors(bytes: &[u8], durable: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    if !bytes.starts_with(durable) {
        // Cut or replaced, and that not synced: one or the other.
        return if rng.random_bool(0.5) { bytes.to_vec() } else { durable.to_vec() };
    }
    let unsynced = bytes.len() - durable.len();
    let mut left = bytes[..durable.len() + rng.random_range(0..=unsynced)].to_vec();
    if rng.random_bool(0.4) {
        for sector in (durable.len()..left.len()).step_by(SECTOR_BYTES) {
            let start = (sector / SECTOR_BYTES * SECTOR_BYTES).max(durable.len());
            let end = left.len().min((start / SECTOR_BYTES + 1) * SECTOR_BYTES);
            if rng.random_bool(0.4) {
                left[start..end].fill(0);
            }
        }
    }
    left
}

fn error(kind: ErrorKind) -> io::Error {
    io::Error::new(kind, "simulated")
}

impl State {
    /// Counts an operation that changes something, and fails it where that is asked for.
    fn operation(&mut self) -> io::Result<()> {
        let n = self.operations;
        self.operations += 1;
        match self.fault {
            Some(Fault::Fails(at) | Fault::FallsShort(at)) if n == at => Err(error(ErrorKind::Other)),
            Some(Fault::Crash(at)) if n >= at => Err(error(ErrorKind::Other)),
            _ => Ok(()),
        }
    }

    fn find(&self, path: &Path) -> io::Result<usize> {
        path.iter().filter(|name| *name != ".").try_fold(0, |id, name| match &self.nodes[id] {
            Node::Folder { names, .. } => {
                names.get(&*name.to_string_lossy()).copied().ok_or_else(|| error(ErrorKind::NotFound))
            }
            Node::File { .. } => Err(error(ErrorKind::NotADirectory)),
        })
    }

    fn names(&mut self, folder: &Path) -> io::Result<&mut Names> {
        let id = self.find(folder)?;
        match &mut self.nodes[id] {
            Node::Folder { names, .. } => Ok(names),
            Node::File { .. } => Err(error(ErrorKind::NotADirectory)),
        }
    }

    fn file(&mut self, path: &Path) -> io::Result<&mut Vec<u8>> {
        let id = self.find(path)?;
        match &mut self.nodes[id] {
            Node::File { bytes, .. } => Ok(bytes),
            Node::Folder { .. } => Err(error(ErrorKind::IsADirectory)),
        }
    }

    fn add(&mut self, path: &Path, node: Node) -> io::Result<usize> {
        let id = self.nodes.len();
        self.nodes.push(node);
        self.names(folder_of(path))?.insert(name_of(path), id);
        Ok(id)
    }

    fn sync(&mut self, id: usize) {
        match &mut self.nodes[id] {
            Node::File { bytes, durable } => durable.clone_from(bytes),
            Node::Folder { names, durable } => durable.clone_from(names),
        }
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

fn name_of(path: &Path) -> String {
    path.file_name().expect("a name").to_string_lossy().into_owned()
}

impl FileSystem for SimulatedDisk {
    fn create_folder(&self, folder: &Path) -> io::Result<()> {
        self.change(|state| {
            let above: Vec<&Path> = folder.ancestors().collect();
            for folder in above.into_iter().rev().filter(|folder| !folder.as_os_str().is_empty()) {
                if state.find(folder).is_err() {
                    state.add(folder, Node::Folder { names: Names::new(), durable: Names::new() })?;
                }
            }
            Ok(())
        })
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<String>> {
        Ok(self.state().names(folder)?.keys().cloned().collect())
    }

    fn read(&self, file: &Path) -> io::Result<Vec<u8>> {
        self.state().file(file).cloned()
    }

    fn size(&self, file: &Path) -> io::Result<u64> {
        Ok(self.state().file(file)?.len() as u64)
    }

    fn create(&self, file: &Path) -> io::Result<Box<dyn Appending>> {
        let id =
            self.change(|state| state.add(file, Node::File { bytes: Vec::new(), durable: Vec::new() }))?;
        Ok(Box::new(SimulatedFile { disk: self.clone(), id }))
    }

    fn truncate(&self, file: &Path, bytes: u64) -> io::Result<()> {
        self.change(|state| {
            state.file(file)?.truncate(bytes as usize);
            Ok(())
        })
    }

    fn sync(&self, path: &Path) -> io::Result<()> {
        self.change(|state| {
            let id = state.find(path)?;
            state.sync(id);
            Ok(())
        })
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.change(|state| {
            let id = state.find(from)?;
            state.names(folder_of(from))?.remove(&name_of(from));
            state.names(folder_of(to))?.insert(name_of(to), id);
            Ok(())
        })
    }

    fn remove(&self, file: &Path) -> io::Result<()> {
        self.change(|state| {
            state.file(file)?;
            state.names(folder_of(file))?.remove(&name_of(file));
            Ok(())
        })
    }

    fn remove_folder(&self, folder: &Path) -> io::Result<()> {
        self.change(|state| {
            state.names(folder)?;
            state.names(folder_of(folder))?.remove(&name_of(folder));
            Ok(())
        })
    }
}

#[derive(Debug)]
struct SimulatedFile {
    disk: SimulatedDisk,
    id: usize,
}

impl Appending for SimulatedFile {
    fn append(&mut self, new: &[u8]) -> io::Result<()> {
        let mut state = self.disk.state();
        let allowed = state.operation();
        let short = matches!(state.fault, Some(Fault::FallsShort(_) | Fault::Crash(_) | Fault::Full));
        let allowed =
            if state.fault == Some(Fault::Full) { Err(error(ErrorKind::StorageFull)) } else { allowed };
        if let Node::File { bytes, .. } = &mut state.nodes[self.id] {
            match allowed {
                Ok(()) => bytes.extend_from_slice(new),
                Err(_) if short => bytes.extend_from_slice(&new[..new.len() / 2]),
                Err(_) => {}
            }
        }
        allowed.map_err(|_| error(ErrorKind::StorageFull))
    }

    fn sync(&mut self) -> io::Result<()> {
        let id = self.id;
        self.disk.change(|state| {
            state.sync(id);
            Ok(())
        })
    }
}
