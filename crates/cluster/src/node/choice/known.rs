//! What a node knows of a map when it chooses, and what it may choose.

use mrol_service::Lead;
use mrol_service::replication::NodeName;
use uuid::Uuid;

use crate::catalog::Placement;
use crate::node::view::View;

/// What a node does about the lead of a map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::node) enum Choice {
    /// Nothing.
    Stay,
    /// It claims to lead.
    Claim,
    /// It takes over by its claim of this id.
    Open(Option<Uuid>),
    /// It gives the lead to another.
    HandOver(NodeName),
}

/// What a node knows of a map when it chooses.
#[derive(Debug, Clone)]
pub(in crate::node) struct Known<'a> {
    /// The node itself.
    pub(in crate::node) own: &'a NodeName,
    /// The map.
    pub(in crate::node) map: Uuid,
    /// Revision of its own copy.
    pub(in crate::node) revision: u64,
    /// Number of the last message of the log that it had read a beat ago.
    pub(in crate::node) sequence_before: u64,
    /// Who leads, as far as it has read the log.
    pub(in crate::node) lead: &'a Lead,
    /// Which nodes hold the map, and which of them is to lead whenever it can.
    pub(in crate::node) placement: &'a Placement,
    /// The others.
    pub(in crate::node) view: &'a View,
    /// Its own beats since it has seen no node lead the map, and no new claim of another.
    pub(in crate::node) waited: u64,
    /// A revision of the beats' bucket after its last claim of the map, once there is one.
    pub(in crate::node) claimed_at: Option<u64>,
    /// Version of the records that it writes.
    pub(in crate::node) record_version: u32,
}
