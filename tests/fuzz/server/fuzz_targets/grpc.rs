#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| mrol_fuzz_server::run("grpc", bytes));
