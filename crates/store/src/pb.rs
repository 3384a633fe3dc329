//! The generated messages of `proto/mrol/store/v1`.

#![expect(unreachable_pub, reason = "generated; the .proto is its documentation")]

include!(concat!(env!("OUT_DIR"), "/mrol.store.v1.rs"));
