//! NetSync's message frame and the independent payloads: accepted bytes are written back
//! identically.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_net::sync::compute::{ObjectHashes, SavedWorld, Step};
use tumble_net::sync::messages::{FrameAck, FacetCounts, Join, Refusal};
use tumble_net::sync::table::Snapshot;
use tumble_net::sync::wire::{message, open};
use tumble_net::sync::{Input, Viewer};

fn written(write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut out = Vec::new();
    write(&mut out);
    out
}

fuzz_target!(|bytes: &[u8]| {
    if let Ok((header, payload)) = open(bytes) {
        assert_eq!(message(&header, |out| out.extend(payload)), bytes);
    }
    let _ = Snapshot::parse(bytes);
    let _ = Refusal::read(bytes);
    Viewer::read(bytes).into_iter().for_each(|x| assert_eq!(written(|out| x.write(out)), bytes));
    Join::read(bytes).into_iter().for_each(|x| assert_eq!(written(|out| x.write(out)), bytes));
    FrameAck::read(bytes).into_iter().for_each(|x| assert_eq!(written(|out| x.write(out)), bytes));
    FacetCounts::read(bytes).into_iter().for_each(|x| assert_eq!(written(|out| x.write(out)), bytes));
    Step::read(bytes).into_iter().for_each(|x| assert_eq!(written(|out| x.write(out)), bytes));
    SavedWorld::read(bytes).into_iter().for_each(|x| assert_eq!(written(|out| x.write(out)), bytes));
    ObjectHashes::read(bytes).into_iter().for_each(|x| assert_eq!(written(|out| x.write(out)), bytes));
    Input::read(bytes).into_iter().for_each(|x| assert_eq!(written(|out| x.write(out)), bytes));
});
