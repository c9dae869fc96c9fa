//! The stream of a VRPN server: the same reports and the same fault whether it comes at once or in pieces.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_net::vrpn::VrpnStream;

fuzz_target!(|bytes: &[u8]| {
    let read = |size: usize| {
        let (mut stream, mut reports) = (VrpnStream::default(), Vec::new());
        let end = bytes
            .chunks(size.max(1))
            .try_for_each(|part| stream.take(part, |report| reports.push(format!("{report:?}"))));
        (reports, end)
    };
    assert_eq!(read(bytes.len()), read(7));
});
