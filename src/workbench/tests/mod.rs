//! The server as a stranger and as a page meet it, over real sockets.

mod bench_file;
mod circle;
mod client;
mod columns;
mod grows;
mod kept;
mod law;
mod parts;
mod safe;
mod signals;
