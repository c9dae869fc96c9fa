//! A world to pixels: draw list without a GPU, wgpu passes, offscreen targets.
