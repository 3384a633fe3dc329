#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| mrol_fuzz::run("las", bytes));
