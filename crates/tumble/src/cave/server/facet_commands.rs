//! Commands that start facets: arguments, launch commands of nodes, addresses.

use crate::cave::address::{ServerAddress, address_towards};
use crate::cave::args::{CaveOptions, ComputeKind, ServeOptions, TransportKind};
use crate::cave::run_setup::PREVIEW;
use crate::cave::web::port_after;
use crate::failure::Failure;
use std::collections::BTreeMap;
use std::net::SocketAddr;
use tumble::net::sync::FacetSlot;
use tumble::scene::cave::{Cave, Facet, Node, Output};

/// Returns the facet slots of a run: all facets, or the preview alone.
pub fn slots(cave: &Cave, preview: bool) -> Vec<FacetSlot> {
    if preview {
        return vec![FacetSlot { name: PREVIEW.into(), critical: true }];
    }
    cave.facets.iter().map(|f| FacetSlot { name: f.name.clone(), critical: f.critical }).collect()
}

/// Returns the server's address as a node reaches it; `None` if there is no route to the node.
pub fn address_for(node: &Node, address: &ServerAddress) -> Option<ServerAddress> {
    match *address {
        ServerAddress::Udp(at) if at.ip().is_unspecified() => {
            address_towards(&node.address, at.port()).map(|ip| ServerAddress::Udp((ip, at.port()).into()))
        }
        _ => Some(address.clone()),
    }
}

/// Returns the launch command of a node with all placeholders filled in. Its stdin is a pipe that
/// ends with the launcher, and the facet ends with the pipe.
pub fn launch(node: &Node, facet: &str, arguments: &[String]) -> Vec<String> {
    let line = arguments.iter().map(|a| shell_quoted(a)).collect::<Vec<_>>().join(" ");
    let fill = |word: &String| match word.as_str() {
        "{arguments}" => arguments.to_vec(),
        _ => vec![
            word.replace("{address}", &node.address)
                .replace("{node}", &node.name)
                .replace("{facet}", facet)
                .replace("{line}", &line),
        ],
    };
    node.launch.iter().flat_map(fill).collect()
}

/// Returns the names of the facets of this machine that are served to browsers.
///
/// # Errors
/// A facet of --web-facets that is none of this machine.
pub fn web_facets(launcher: &CaveOptions, cave: &Cave) -> Result<Vec<String>, Failure> {
    let Some(first) = launcher.web.web else { return Ok(Vec::new()) };
    let local = |facet: &&Facet| facet.node.is_none_or(|node| cave.nodes[node].is_local());
    let all: Vec<&str> = cave.facets.iter().filter(local).map(|facet| facet.name.as_str()).collect();
    if let Some(name) = launcher.web_facets.iter().find(|name| !all.contains(&name.as_str())) {
        let what = format!("no facet of this machine is named {name}; there are {}", all.join(", "));
        return Err(Failure::input(format!("--web {first}: {what}")));
    }
    let chosen = |name: &&str| launcher.web_facets.is_empty() || launcher.web_facets.iter().any(|one| one == name);
    let web: Vec<String> = all.into_iter().filter(chosen).map(str::to_owned).collect();
    if launcher.draw.frames_dir.is_some() && web.len() == cave.facets.len() {
        let why = "browsers show all facets and keep their pictures, so there is none to write; --web-facets names fewer, --log-dir writes frames.jsonl alone";
        return Err(Failure::input(format!("--web {first} with --frames-dir: {why}")));
    }
    Ok(web)
}

/// Returns the addresses at which facets serve browsers, by name: one after the other, process by process,
/// because the facets of a process are at successive ports.
///
/// # Errors
/// A port beyond the last.
pub fn web_addresses(
    launcher: &CaveOptions,
    cave: &Cave,
    processes: &[Vec<usize>],
    web: &[String],
) -> Result<BTreeMap<String, SocketAddr>, Failure> {
    let Some(first) = launcher.web.web else { return Ok(BTreeMap::new()) };
    let names = processes.iter().flatten().map(|&k| &cave.facets[k].name).filter(|name| web.contains(name));
    (0..).zip(names).map(|(k, name)| Ok((name.clone(), port_after(first, k, name)?))).collect()
}

/// Returns the facets of a run by process: those with one `process` on a node, or, with --one-process, all of
/// a node with one adapter and one kind of output. Facets that browsers show are apart from others.
pub fn processes(cave: &Cave, launcher: Option<&CaveOptions>, web: &[String]) -> Vec<Vec<usize>> {
    if launcher.is_some_and(|launcher| launcher.preview) {
        return vec![vec![0]];
    }
    let one_process = launcher.is_some_and(|launcher| launcher.one_process);
    let in_memory =
        |facet: &Facet| launcher.is_some_and(|launcher| launcher.draw.offscreen) || facet.output == Output::Offscreen;
    let with = |a: &Facet, b: &Facet| {
        let same = match one_process {
            true => a.display.gpu == b.display.gpu && in_memory(a) == in_memory(b),
            false => a.process.is_some() && a.process == b.process,
        };
        same && a.node == b.node && web.contains(&a.name) == web.contains(&b.name)
    };
    let mut processes: Vec<Vec<usize>> = Vec::new();
    for (k, facet) in cave.facets.iter().enumerate() {
        match processes.iter_mut().find(|members| with(&cave.facets[members[0]], facet)) {
            Some(members) => members.push(k),
            None => processes.push(vec![k]),
        }
    }
    processes
}

/// Why a process of facets is started.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum FacetStart {
    /// For the first time in a run.
    First,
    /// In the place of one that has ended.
    Again,
    /// To take the place of one that may end.
    StandBy,
}

/// Returns the arguments of a process with these facets; `web` is the address at which the first one serves
/// browsers.
pub fn facet_args(
    launcher: &CaveOptions,
    names: &[&str],
    address: &ServerAddress,
    web: Option<&SocketAddr>,
    start: FacetStart,
) -> Vec<String> {
    let mut args = vec!["facet".to_owned()];
    args.extend(scene_args(&launcher.serve));
    if launcher.preview {
        args.push("--preview".into())
    } else {
        args.extend(["--facet".into(), names.join(",")])
    }
    args.extend(match address {
        ServerAddress::Memory(run) => ["--run".into(), run.clone()],
        ServerAddress::Udp(server) => ["--server".into(), local(*server).to_string()],
    });
    let draw = &launcher.draw;
    let folder = |option: &str, path: &Option<std::path::PathBuf>| {
        path.iter().flat_map(|p| [option.to_owned(), p.display().to_string()]).collect::<Vec<_>>()
    };
    // browsers keep their pictures
    args.extend(folder(if web.is_some() { "--log-dir" } else { "--frames-dir" }, &draw.frames_dir));
    args.extend(folder("--log-dir", &draw.log_dir));
    if let Some(at) = web {
        args.extend(["--web".into(), at.to_string(), "--web-timeout".into(), launcher.web.web_timeout.to_string()]);
        args.extend(folder("--web-key", &launcher.web.web_key));
    }
    args.extend(draw.quality.iter().flat_map(|q| ["--quality".to_owned(), q.to_string()]));
    args.extend(
        Some(draw.debug_draw.to_string())
            .filter(|w| !w.is_empty())
            .iter()
            .flat_map(|w| ["--debug-draw".to_owned(), w.clone()]),
    );
    let first = start == FacetStart::First;
    let switches = [
        ("--overwrite", draw.overwrite && first),
        ("--continue-frames", !first),
        ("--stand-by", start == FacetStart::StandBy),
        ("--burn-in", draw.burn_in),
        ("--offscreen", draw.offscreen),
        ("--no-pictures", draw.no_pictures),
        ("--watch-pictures", launcher.serve.console.is_some() && !draw.no_pictures),
    ];
    args.extend(switches.iter().filter(|(_, on)| *on).map(|(name, _)| (*name).to_owned()));
    // the launcher times out before its facets
    let wait = launcher.serve.connect_timeout.map_or("600".to_owned(), |s| (s + 10.0).to_string());
    args.extend(["--connect-timeout".into(), wait, "--parent-watch".into()]);
    args
}

/// Returns the arguments that name scene and cave.
pub fn scene_args(serve: &ServeOptions) -> Vec<String> {
    let surroundings = &serve.surroundings;
    let mut args = vec![serve.scene.name.clone()];
    args.extend(serve.scene.opening.to_args());
    args.extend(["--cave".into(), surroundings.cave.clone()]);
    args.extend(surroundings.environment.iter().flat_map(|e| ["--environment".into(), e.clone()]));
    match serve.compute {
        None => {}
        Some(ComputeKind::Server) => args.extend(["--compute".into(), "server".into()]),
        Some(ComputeKind::Everywhere) => {
            args.extend(["--compute".into(), "everywhere".into()]);
            args.extend(serve.scene.stepping_args());
            args.extend(serve.user_colliders.then(|| "--user-colliders".to_owned()));
        }
    }
    args
}

/// Returns an address on which this machine listens, as this machine reaches it.
fn local(at: std::net::SocketAddr) -> std::net::SocketAddr {
    match at.ip().is_unspecified() {
        true if at.is_ipv4() => (std::net::Ipv4Addr::LOCALHOST, at.port()).into(),
        true => (std::net::Ipv6Addr::LOCALHOST, at.port()).into(),
        false => at,
    }
}

/// Quotes a word for a shell.
pub fn shell_quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./=:".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Returns the transport: from the command line, else from the cave.
pub fn transport_kind(serve: &ServeOptions, cave: &Cave) -> TransportKind {
    let of_cave = if cave.sync.transport == tumble::scene::cave::Transport::Udp {
        TransportKind::Udp
    } else {
        TransportKind::SharedMemory
    };
    serve.transport.unwrap_or(of_cave)
}
