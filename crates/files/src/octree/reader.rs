//! Reading trees, leaf by leaf.

use std::io::{BufRead, ErrorKind, Read};

use super::error::OctreeError;
use super::header::{Header, NodeFormat};
use super::leaf::{CellState, Code, DEPTH, Leaf, cells_of};
use crate::counted::Counted;

/// The leaves of a file, ascending in the order of the file: `.bt` and `.ot`, told apart by their first line.
///
/// Holds the path to a leaf, whatever the file claims. Probabilities become states as OctoMap does it: log-odds of 0
/// and above are occupied.
#[derive(Debug)]
pub struct OctreeReader<R> {
    file: Counted<R>,
    header: Header,
    /// The nodes from the root to where reading stands, whose children are left.
    path: Vec<Node>,
    /// Nodes so far, leaves among them.
    nodes: u64,
    progress: Progress,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Progress {
    AtRoot,
    Inside,
    /// Read to its end, or an error was given out.
    Over,
}

/// A node that has children.
#[derive(Debug, Clone, Copy)]
struct Node {
    code: Code,
    level: u32,
    children: Children,
    /// The next child.
    next: u32,
}

/// What is known of the children of a node.
#[derive(Debug, Clone, Copy)]
enum Children {
    /// Of `.bt`: two bits each.
    States(u16),
    /// Of `.ot`: a bit each.
    Present(u8),
    /// The root is a leaf: each child is one of that state.
    Leaves(CellState),
}

/// What a file has in the place of a child.
enum Child {
    Unknown,
    Leaf(CellState),
    Node(Children),
}

impl<R: BufRead> OctreeReader<R> {
    /// Reads the lines before the tree.
    ///
    /// # Errors
    /// When the file is no octree, or one whose nodes are unknown or whose cells no map can have.
    pub fn new(file: R) -> Result<Self, OctreeError> {
        let mut file = Counted::new(file);
        let header = Header::read(&mut file)?;
        Ok(Self { file, header, path: Vec::new(), nodes: 0, progress: Progress::AtRoot })
    }

    /// Side of a finest cell, meters: a resolution that a map can have.
    pub fn resolution_m(&self) -> f64 {
        self.header.resolution_m
    }

    /// Bytes of the file that were read.
    pub fn position(&self) -> u64 {
        self.file.position()
    }

    /// The next leaf; none at the end of the tree.
    ///
    /// # Errors
    /// When the file is cut off, or no tree of a map's depth.
    pub fn next_leaf(&mut self) -> Result<Option<Leaf>, OctreeError> {
        let leaf = self.advance();
        if !matches!(leaf, Ok(Some(_))) {
            self.progress = Progress::Over;
        }
        leaf
    }

    fn advance(&mut self) -> Result<Option<Leaf>, OctreeError> {
        match self.progress {
            Progress::Over => return Ok(None),
            Progress::AtRoot => {
                self.progress = Progress::Inside;
                self.read_root()?;
            }
            Progress::Inside => {}
        }
        while let Some(node) = self.path.last_mut() {
            if node.next == 8 {
                self.path.pop();
                continue;
            }
            let child = node.next;
            node.next += 1;
            let Node { code, level, children, .. } = *node;
            let (code, level) = (code + u64::from(child) * cells_of(level - 1), level - 1);
            match self.read_child(children, child)? {
                Child::Unknown => {}
                Child::Leaf(state) => return Ok(Some(Leaf::at(code, level, state))),
                Child::Node(_) if level == 0 => return Err(OctreeError::TooDeep(self.nodes)),
                Child::Node(children) => self.path.push(Node { code, level, children, next: 0 }),
            }
        }
        self.check_end().map(|()| None)
    }

    fn read_root(&mut self) -> Result<(), OctreeError> {
        // A tree without a node has no root either.
        if self.header.nodes == 0 {
            return Ok(());
        }
        self.nodes = 1;
        let children = match self.header.format {
            NodeFormat::States => Children::States(self.read_states()?),
            NodeFormat::LogOdds { .. } => match self.read_log_odds()? {
                Child::Node(children) => children,
                Child::Leaf(state) => Children::Leaves(state),
                Child::Unknown => return Ok(()),
            },
        };
        self.path.push(Node { code: 0, level: DEPTH, children, next: 0 });
        Ok(())
    }

    /// What is in the place of a child, of which bytes follow here.
    fn read_child(&mut self, children: Children, child: u32) -> Result<Child, OctreeError> {
        match children {
            Children::Leaves(state) => Ok(Child::Leaf(state)),
            Children::Present(present) if present >> child & 1 == 0 => Ok(Child::Unknown),
            Children::Present(_) => {
                self.nodes += 1;
                self.read_log_odds()
            }
            Children::States(states) => {
                let state = states >> (2 * child) & 3;
                self.nodes += u64::from(state != 0);
                match state {
                    0 => Ok(Child::Unknown),
                    1 => Ok(Child::Leaf(CellState::Free)),
                    2 => Ok(Child::Leaf(CellState::Occupied)),
                    _ => Ok(Child::Node(Children::States(self.read_states()?))),
                }
            }
        }
    }

    fn read_states(&mut self) -> Result<u16, OctreeError> {
        self.read_bytes().map(u16::from_le_bytes)
    }

    /// The state of a leaf by its log-odds, or which children a node has.
    fn read_log_odds(&mut self) -> Result<Child, OctreeError> {
        let log_odds = f32::from_le_bytes(self.read_bytes()?);
        if let NodeFormat::LogOdds { ignored_bytes: 3 } = self.header.format {
            self.read_bytes::<3>()?;
        }
        let [present] = self.read_bytes()?;
        match (log_odds.is_nan(), present) {
            (true, _) => Err(OctreeError::NotANumber(self.nodes)),
            (false, 0) if log_odds >= 0.0 => Ok(Child::Leaf(CellState::Occupied)),
            (false, 0) => Ok(Child::Leaf(CellState::Free)),
            (false, _) => Ok(Child::Node(Children::Present(present))),
        }
    }

    fn read_bytes<const N: usize>(&mut self) -> Result<[u8; N], OctreeError> {
        let mut bytes = [0; N];
        self.file.read_exact(&mut bytes).map_err(|error| match error.kind() {
            // The node at hand is not there.
            ErrorKind::UnexpectedEof => {
                OctreeError::CutOff { nodes: self.nodes - 1, claimed: self.header.nodes }
            }
            _ => error.into(),
        })?;
        Ok(bytes)
    }

    fn check_end(&mut self) -> Result<(), OctreeError> {
        let (nodes, claimed) = (self.nodes, self.header.nodes);
        if nodes != claimed {
            return Err(OctreeError::Nodes { nodes, claimed });
        }
        match self.file.fill_buf()? {
            [] => Ok(()),
            _ => Err(OctreeError::Appended(self.file.position())),
        }
    }
}
