//! The server's process of a run: it simulates the scene, publishes frames, starts the facets'
//! processes and writes the recording and the summary.

mod contact_sound;
mod ending;
mod facet_commands;
mod facet_process;
mod facet_processes;
mod histogram;
mod input_devices;
mod live_viewers;
mod operator;
mod outputs;
mod recording;
mod serve;
mod sounds;
mod start;
mod summary;
mod user_audio;

pub use facet_process::title;
pub use outputs::say;
pub use start::run;
pub use summary::Difference;
