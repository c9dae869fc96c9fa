//! `[tracker]` and the launch commands of nodes in cave files.

use crate::caves::SMALL;
use std::net::{IpAddr, Ipv4Addr};
use tumble_scene::cave::{Axes, Cave, DeviceMap};

fn error_of(text: &str) -> String {
    Cave::parse(&format!("{SMALL}{text}"), "my.toml").expect_err("it is wrong").to_string()
}

#[test]
fn a_tracker_is_heard_on_this_machine_and_elsewhere_by_name() {
    let of = |text: &str| {
        Cave::parse(&format!("{SMALL}{text}"), "my.toml").unwrap_or_else(|e| panic!("{e}")).tracker.unwrap()
    };
    assert_eq!(Cave::parse(SMALL, "my.toml").unwrap().tracker, None);
    let usual = of("[tracker]\n");
    assert_eq!(
        (usual.socket(), &usual.users[..], usual.axes, usual.origin_m),
        ("127.0.0.1:47200".parse().unwrap(), &["u".to_owned()][..], Axes::ZUp, [0.0; 3])
    );
    let far = of(
        "[tracker]\naddress = \"0.0.0.0\"\nport = 9000\nusers = [\"glasses 1\"]\nsenders = [\"10.0.0.7\"]\naxes = \"y_up\"\norigin_m = [0, 1, 0]\n",
    );
    assert_eq!(
        (far.senders, far.axes, far.users),
        (vec![IpAddr::from(Ipv4Addr::new(10, 0, 0, 7))], Axes::YUp, vec!["glasses 1".to_owned()])
    );
    let vrpn = of("[tracker]\nusers = [\"eva\"]\nvrpn = \"wall:3883\"\nvrpn_map = [\"Glasses 1:2=eva/hand/left\"]\n");
    let map = DeviceMap { device: "Glasses 1".into(), sensor: 2, user: "eva".into(), part: "hand/left".into() };
    assert_eq!((vrpn.vrpn.as_deref(), vrpn.vrpn_map), (Some("wall:3883"), vec![map]));
    let dtrack = of("[tracker]\ndtrack_map = [\"body:0=u/head\", \"flystick:1=u/buttons\"]\n").dtrack_map;
    assert_eq!((dtrack[0].device.as_str(), dtrack[1].sensor, dtrack.len()), ("body", 1, 2));
    let headset = of("[tracker]\nusers = [\"eva\"]\nopenxr = \"eva\"\norigin_m = [0, 0, 1.6]\n");
    assert_eq!((headset.openxr.as_deref(), headset.axes), (Some("eva"), Axes::YUp));
    let cases = [
        ("[tracker]\nopenxr = \"other\"\n", "a user of this tracker: u"),
        ("[tracker]\nopenxr = 7\n", "`openxr`"),
        ("[tracker]\nopenxr = \"u\"\naxes = \"z_up\"\n", "the axes of OpenXR"),
        ("[tracker]\nopenxr = \"u\"\ndtrack_map = [\"body:0=u/head\"]\n", "has `openxr` and `dtrack_map`"),
        ("[tracker]\nopenxr = \"u\"\nvrpn = \"here:3883\"\nvrpn_map = [\"G=u/head\"]\n", "has `openxr` and `vrpn`"),
        ("[tracker]\ndtrack_map = [\"glove:0=u/hand/left\"]\n", "body:NUMBER or flystick:NUMBER"),
        ("[tracker]\ndtrack_map = [\"body:0=u/buttons\"]\n", "buttons of a flystick alone"),
        ("[tracker]\ndtrack_map = [\"body:0=other/head\"]\n", "a user of this tracker: u"),
        (
            "[tracker]\nvrpn = \"here:3883\"\nvrpn_map = [\"G=u/head\"]\ndtrack_map = [\"body:0=u/head\"]\n",
            "expected one tracker",
        ),
        ("[tracker]\naddress = \"0.0.0.0\"\n", "without `senders`"),
        ("[tracker]\naddress = \"here\"\n", "expected an IP address"),
        ("[tracker]\nsealed = true\n", "expected a [security] with a key_file"),
        ("[tracker]\nport = 0\n", "an integer from 1 to 65535"),
        ("[tracker]\nvrpn = \"here\"\nvrpn_map = [\"G=u/head\"]\n", "HOST:PORT, such as"),
        ("[tracker]\nvrpn = \"here:3883\"\n", "no device moves a user"),
        ("[tracker]\nvrpn_map = [\"G=u/head\"]\n", "`vrpn_map` without `vrpn`"),
        ("[tracker]\nvrpn = \"here:3883\"\nvrpn_map = [\"G=u/foot\"]\n", "a PART of head, wand"),
        ("[tracker]\nvrpn = \"here:3883\"\nvrpn_map = [\"G=other/head\"]\n", "a user of this tracker: u"),
        ("[tracker]\nusers = [\"a\", \"b\"]\n", "one unique name without / for each of the cave's 1 users"),
        ("[tracker]\nusers = [\"a/b\"]\n", "without /"),
        ("[tracker]\nsenders = [7]\n", "`senders`"),
        ("[tracker]\naxes = \"east\"\n", "`y_up`"),
        ("[tracker]\norigin_m = [0, nan, 0]\n", "finite"),
    ];
    for (text, said) in cases {
        assert!(error_of(text).contains(said), "{text}: {}", error_of(text));
    }
}

#[test]
fn a_launch_command_names_the_arguments_and_nothing_unknown() {
    let node = |launch: &str| format!("[[node]]\nname = \"n\"\naddress = \"127.0.0.1\"\nlaunch = {launch}\n");
    let cave =
        Cave::parse(&format!("{SMALL}{}", node("[\"ssh\", \"{address}\", \"tumble {line}\"]")), "my.toml").unwrap();
    assert_eq!(cave.nodes[0].launch, ["ssh", "{address}", "tumble {line}"]);
    let cases = [
        ("[]", "the words of a command"),
        ("\"ssh\"", "the words of a command"),
        ("[\"ssh\", \"{address}\"]", "with {arguments} or {line} among them"),
        ("[\"ssh\", \"tumble {arguments}\"]", "{arguments} as a word by itself"),
        ("[\"ssh\", \"{host}\", \"{arguments}\"]", "there is no {host}"),
        ("[\"\", \"{arguments}\"]", "the words of a command"),
    ];
    for (launch, said) in cases {
        assert!(error_of(&node(launch)).contains(said), "{launch}: {}", error_of(&node(launch)));
    }
}
