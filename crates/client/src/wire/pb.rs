//! The types that `build.rs` generates from `proto/mrol/v1`.

#![expect(missing_docs, reason = "the comments of the proto files document what is generated")]
#![allow(clippy::allow_attributes, reason = "the generator writes `allow`")]
#![allow(unreachable_pub, clippy::all, reason = "generated code follows its generator's style")]

tonic::include_proto!("mrol.v1");

/// The contract as a `FileDescriptorSet`, for reflection.
pub const FILE_DESCRIPTOR_SET: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/mrol.v1.bin"));
