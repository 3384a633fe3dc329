//! Connections are secured, in both protocols, and certificates change without a restart.

mod authority;
mod command_line;
mod expiry;
mod handshake;
mod reloading;
mod settings;
