//! A node that holds a map which another does not.

/// A node of the cluster that holds a map, and where it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapHolder {
    /// Its name.
    pub node: String,
    /// Address of its HTTP: `http://HOST:PORT` or `https://HOST:PORT`.
    pub http: String,
    /// Address of its gRPC, likewise.
    pub grpc: String,
}
