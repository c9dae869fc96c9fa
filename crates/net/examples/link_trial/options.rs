//! Options of the command line.

use super::Failure;
use std::net::SocketAddr;
use std::path::PathBuf;
use tumble_net::sync::udp::network::Faults;

/// The part of a trial that a process plays.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Starts the other processes and is the server.
    All,
    Server,
    Facet,
    /// A process between the server and the facets that simulates a bad network.
    Relay,
}

#[derive(Clone)]
pub struct Options {
    pub role: Role,
    pub transport: String,
    pub run: String,
    pub facets: u16,
    pub facet: u16,
    pub frames: u64,
    pub bytes: usize,
    pub rate: f64,
    pub address: SocketAddr,
    pub connect: SocketAddr,
    pub listen: SocketAddr,
    pub key: Option<PathBuf>,
    pub faults: Faults,
    pub seed: u64,
    pub stay_awake: bool,
}

const USAGE: &str = "link_trial [--transport shm|udp] [--facets 6] [--bytes 65536] [--rate 500] [--frames 2000] [--stay-awake yes]
  udp: [--address 127.0.0.1:7711] [--key FILE] [--loss 0.05] [--reorder 0.1] [--duplicate 0.02] [--delay-ms 1] [--jitter-ms 0] [--seed 1]
  apart: --role server | --role facet --facet K --connect ADDRESS | --role relay --listen ADDRESS --address SERVER;   shm: [--run NAME]";

impl Options {
    pub fn read(mut words: impl Iterator<Item = String>) -> Result<Options, Failure> {
        let local: SocketAddr = ([127, 0, 0, 1], 7711).into();
        let mut o = Options {
            role: Role::All,
            transport: "shm".into(),
            run: format!("trial-{}", std::process::id()),
            facets: 6,
            facet: 0,
            frames: 2000,
            bytes: 65536,
            rate: 500.0,
            address: local,
            connect: local,
            listen: local,
            key: None,
            faults: Faults::default(),
            seed: 1,
            stay_awake: false,
        };
        while let Some(word) = words.next() {
            let value = words.next().ok_or_else(|| format!("{word} needs a value\n{USAGE}"))?;
            let fraction = || {
                value
                    .parse::<f64>()
                    .ok()
                    .filter(|x| (0.0..=1.0).contains(x))
                    .ok_or_else(|| format!("{word} {value}: expected a fraction from 0 to 1"))
            };
            let ms = || {
                value
                    .parse::<f64>()
                    .ok()
                    .filter(|x| (0.0..=1e4).contains(x))
                    .ok_or_else(|| format!("{word} {value}: expected milliseconds, 0 to 10000"))
            };
            match word.as_str() {
                "--role" => {
                    o.role = match value.as_str() {
                        "server" => Role::Server,
                        "facet" => Role::Facet,
                        "relay" => Role::Relay,
                        _ => return Err(format!("--role {value}: expected server, facet or relay").into()),
                    }
                }
                "--transport" if ["shm", "udp"].contains(&value.as_str()) => o.transport = value,
                "--run" => o.run = value,
                "--facets" => o.facets = value.parse()?,
                "--facet" => o.facet = value.parse()?,
                "--frames" => o.frames = value.parse()?,
                "--bytes" => o.bytes = value.parse::<usize>()?.clamp(32, 16 << 20),
                "--rate" => o.rate = value.parse::<f64>()?.clamp(0.1, 1e5),
                "--address" => o.address = value.parse()?,
                "--connect" => o.connect = value.parse()?,
                "--listen" => o.listen = value.parse()?,
                "--key" => o.key = Some(value.into()),
                "--loss" => o.faults.loss = fraction()?,
                "--reorder" => o.faults.reorder = fraction()?,
                "--duplicate" => o.faults.duplicate = fraction()?,
                "--flip" => o.faults.flip = fraction()?,
                "--delay-ms" => o.faults.delay_s = ms()? / 1e3,
                "--jitter-ms" => o.faults.jitter_s = ms()? / 1e3,
                "--seed" => o.seed = value.parse()?,
                "--stay-awake" => o.stay_awake = value == "yes",
                _ => return Err(format!("unknown option or value: {word} {value}\n{USAGE}").into()),
            }
        }
        Ok(o)
    }

    /// Returns the arguments that the other processes need.
    pub fn arguments(&self) -> Vec<String> {
        let mut words: Vec<String> = Vec::new();
        let mut add = |name: &str, value: String| words.extend([format!("--{name}"), value]);
        add("transport", self.transport.clone());
        add("run", self.run.clone());
        add("bytes", self.bytes.to_string());
        add("address", self.address.to_string());
        add("seed", self.seed.to_string());
        let f = &self.faults;
        for (name, value) in [("loss", f.loss), ("reorder", f.reorder), ("duplicate", f.duplicate), ("flip", f.flip)] {
            add(name, value.to_string());
        }
        add("delay-ms", (1e3 * f.delay_s).to_string());
        add("jitter-ms", (1e3 * f.jitter_s).to_string());
        if let Some(key) = &self.key {
            add("key", key.display().to_string());
        }
        words
    }
}
