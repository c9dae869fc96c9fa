//! A warp grid or a curved screen of a projector, PFM or OBJ; small pictures are warped by it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use tumble_render::{Image, ScreenMesh, Warp};

fuzz_target!(|bytes: &[u8]| {
    let picture = Image { width: 16, height: 12, rgba: vec![200; 4 * 16 * 12] };
    for warp in [Warp::from_pfm(bytes), Warp::from_obj(bytes)].into_iter().flatten() {
        let warped = warp.apply(&picture);
        assert_eq!((warped.width, warped.height, warped.rgba.len()), (16, 12, picture.rgba.len()));
    }
    let _ = (ScreenMesh::from_pfm(bytes), ScreenMesh::from_obj(bytes));
});
