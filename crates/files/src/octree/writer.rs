//! Writing trees.

use std::io::{self, Write};

use super::header::{Header, NodeFormat};
use super::leaf::{CellState, Code, DEPTH, cells_of};
use super::octree_of_leaves::{Octree, PackedLeaf};

/// Log-odds of an occupied cell of `.ot`: those at which OctoMap stops counting hits, of a probability of 0.971.
pub const LOG_ODDS_OCCUPIED: f32 = 3.511_030_7;
/// Log-odds of a free cell of `.ot`: those at which OctoMap stops counting rays, of a probability of 0.1192.
pub const LOG_ODDS_FREE: f32 = -2.000_028;

impl Octree {
    /// Writes the tree as `.bt`, with cells of `resolution_m`: what OctoMap writes of it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_binary(&self, resolution_m: f64, file: &mut impl Write) -> io::Result<()> {
        self.write(NodeFormat::States, resolution_m, file)
    }

    /// Writes the tree as `.ot`, with cells of `resolution_m`: cells are as certain as OctoMap lets them be, inner
    /// nodes as likely occupied as the most likely of their children.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_full(&self, resolution_m: f64, file: &mut impl Write) -> io::Result<()> {
        self.write(NodeFormat::LogOdds { ignored_bytes: 0 }, resolution_m, file)
    }

    fn write(&self, format: NodeFormat, resolution_m: f64, file: &mut impl Write) -> io::Result<()> {
        Header { format, nodes: self.nodes(), resolution_m }.write(file)?;
        let root = Branch { code: 0, level: DEPTH, leaves: self.packed_leaves() };
        match format {
            _ if self.is_empty() => Ok(()),
            NodeFormat::States => root.write_states(file),
            NodeFormat::LogOdds { .. } => root.write_log_odds(file),
        }
    }
}

/// A node with the leaves in it, at least one.
#[derive(Clone, Copy)]
struct Branch<'a> {
    code: Code,
    level: u32,
    leaves: &'a [PackedLeaf],
}

impl<'a> Branch<'a> {
    /// The children that have leaves, with their numbers.
    fn children(self) -> impl Iterator<Item = (u32, Self)> {
        let level = self.level - 1;
        let mut left = self.leaves;
        (0..8).filter_map(move |child| {
            let code = self.code + u64::from(child) * cells_of(level);
            let end = code + cells_of(level);
            let (leaves, after) = left.split_at(left.partition_point(|leaf| leaf.code() < end));
            left = after;
            (!leaves.is_empty()).then_some((child, Self { code, level, leaves }))
        })
    }

    /// The leaf that takes the whole node.
    fn leaf(self) -> Option<CellState> {
        self.leaves.first().filter(|leaf| leaf.level() == self.level).map(|leaf| leaf.state())
    }

    /// Writes the states of the children, then the children. As deep as the tree.
    fn write_states(self, file: &mut impl Write) -> io::Result<()> {
        let state = |branch: Self| match branch.leaf() {
            Some(CellState::Free) => 1_u16,
            Some(CellState::Occupied) => 2,
            None => 3,
        };
        let states = self.children().fold(0, |states, (child, branch)| states | state(branch) << (2 * child));
        file.write_all(&states.to_le_bytes())?;
        self.children()
            .filter(|(_, branch)| branch.leaf().is_none())
            .try_for_each(|(_, branch)| branch.write_states(file))
    }

    /// Writes the node, then its children. As deep as the tree.
    fn write_log_odds(self, file: &mut impl Write) -> io::Result<()> {
        let is_occupied = self.leaves.iter().any(|leaf| leaf.state() == CellState::Occupied);
        let log_odds = if is_occupied { LOG_ODDS_OCCUPIED } else { LOG_ODDS_FREE };
        file.write_all(&log_odds.to_le_bytes())?;
        if self.leaf().is_some() {
            return file.write_all(&[0]);
        }
        let present = self.children().fold(0, |present, (child, _)| present | 1_u8 << child);
        file.write_all(&[present])?;
        self.children().try_for_each(|(_, branch)| branch.write_log_odds(file))
    }
}
