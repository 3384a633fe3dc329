//! The services of `proto/mrol/v1` as traits, and what routes requests to them: made by `build.rs`.

#![allow(clippy::allow_attributes, reason = "the generator writes `allow`")]
#![allow(unreachable_pub, clippy::all, reason = "generated code follows its generator's style")]

tonic::include_proto!("mrol.v1");
