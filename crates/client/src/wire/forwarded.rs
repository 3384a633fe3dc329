//! What a node of a cluster says of calls that it forwards, besides the secret of the cluster.

/// The metadata that holds the name of the node that forwards a call.
pub const NODE: &str = "mrol-node";

/// The metadata that holds the name of the key for whose holder it does; missing where no keys are asked for.
pub const CALLER: &str = "mrol-caller";
