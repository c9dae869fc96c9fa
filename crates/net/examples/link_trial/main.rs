//! Measures speed and reliability of a transport: a server, and facets in processes of their own.
//! Nothing is simulated or drawn.
//!
//! ```sh
//! cargo run --release -p tumble-net --example link_trial -- --transport shm --facets 6 --bytes 65536 --rate 500 --frames 2000
//! cargo run --release -p tumble-net --example link_trial -- --transport udp --facets 2 --bytes 16384 --rate 60 --frames 2000 --loss 0.05
//! ```
//!
//! `--stay-awake yes` prevents idle states of the cores during the trial (`/dev/cpu_dma_latency`,
//! usually writable by root only).
//!
//! Each frame goes the whole way: STATE to all facets, READY from each, PRESENT to all, PRESENTED
//! from each. Times are taken by the clock of this machine, which all processes share.
//! `scripts/netns.sh` runs the same between network namespaces, with separate roles (`--role
//! server`, `facet`, `relay`).

mod facet;
mod options;
mod relay;
mod report;
mod server;

use options::{Options, Role};
use std::process::{Child, Command};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// An error that ends the trial, in words.
type Failure = Box<dyn std::error::Error>;

/// Returns the time in nanoseconds, by a clock that all processes of this machine share.
fn clock_ns() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64)
}

fn main() {
    let result = Options::read(std::env::args().skip(1)).and_then(run);
    if let Err(why) = result {
        eprintln!("error: {why}");
        std::process::exit(1);
    }
}

fn run(options: Options) -> Result<(), Failure> {
    match options.role {
        Role::All => run_all(options),
        Role::Server => server::run(&options),
        Role::Facet => facet::run(&options),
        Role::Relay => relay::run(&options),
    }
}

/// Processes that end within a second after this one.
struct Children(Vec<Child>);

impl Drop for Children {
    fn drop(&mut self) {
        let end = Instant::now() + Duration::from_secs(1);
        for child in &mut self.0 {
            while Instant::now() < end && matches!(child.try_wait(), Ok(None)) {
                std::thread::sleep(Duration::from_millis(10));
            }
            if !matches!(child.try_wait(), Ok(Some(_))) {
                let _ = child.kill();
                let _ = child.wait();
            }
        }
    }
}

/// Starts a process per facet, and a relay if there are faults; runs the server; ends the
/// processes.
fn run_all(mut options: Options) -> Result<(), Failure> {
    let mut children = Children(Vec::new());
    let program = std::env::current_exe()?;
    let start = |children: &mut Children, role: &str, more: &[String]| -> Result<(), Failure> {
        children.0.push(Command::new(&program).args(["--role", role]).args(options.arguments()).args(more).spawn()?);
        Ok(())
    };
    let mut connect = options.address;
    if options.faults != Default::default() {
        connect.set_port(options.address.port() + 1);
        start(&mut children, "relay", &["--listen".into(), connect.to_string()])?;
    }
    for facet in 0..options.facets {
        start(&mut children, "facet", &["--facet".into(), facet.to_string(), "--connect".into(), connect.to_string()])?;
    }
    options.role = Role::Server;
    let result = server::run(&options);
    drop(children);
    if options.transport == "shm" {
        tumble_net::sync::shm::clean_up()?;
    }
    result
}
