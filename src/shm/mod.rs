//! The iceoryx2 services of a bench, their names, heartbeats.
