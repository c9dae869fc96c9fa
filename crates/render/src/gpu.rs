//! The renderer: a device without a window, and the order of its passes.

mod cull;
mod data;
mod enlarge;
mod finish;
mod frame;
mod kept;
mod meshes;
mod particles;
mod pipeline_plan;
mod pipelines;
mod portable;
mod reading;
mod recipe;
mod scene;
mod shadow;
mod soft;
mod spheres;
mod stage;
mod targets;
mod textures;
mod window;

use crate::list::bounds::Bounds;
use crate::{DrawList, Image, Lens, MAX_PIXELS, MAX_SIDE, Part, RenderError, Viewpoint};
use enlarge::{Drawn, Enlarger};
use finish::Finisher;
pub(crate) use finish::{Around, Bend, Finish, Placed, place_floats};
use frame::Frame;
use meshes::MeshCache;
use nalgebra::Matrix4;
pub use particles::{
    FreeParticle, FreeParticles, GpuParticles, MAX_OBSTACLES, MAX_PARTICLES, Obstacle, ObstacleShape, Precision,
};
use pipelines::Pipelines;
pub use portable::{PortableDraw, PortableItems, PortableKey, PortablePicture, PortableView};
use reading::Readbacks;
pub use reading::Reading;
pub use recipe::{GlslProgram, GlslTranslator, Recipe, portable_pass_wgsl, portable_wgsl};
pub use stage::Stage;
use stage::Textures;
use std::sync::{Arc, Mutex, PoisonError};
use targets::{ShadowMaps, Targets};
use textures::TextureCache;
pub use window::{Screen, Shown, Wall};

/// Targets of several sizes are kept while they have at most this many pixels in total.
const KEPT_PIXELS: u64 = 8 << 20;
/// Longest wait for the last work of a device that has reported an error.
const LAST_WORK: std::time::Duration = std::time::Duration::from_secs(2);

/// A graphics device that draws into memory. Creating one takes a moment, so one renderer should
/// draw all pictures of a run.
pub struct Renderer {
    gpu: Gpu,
    pipelines: Pipelines,
    meshes: MeshCache,
    textures: TextureCache,
    finisher: Finisher,
    /// Made for the first picture of half resolution.
    enlarger: Option<Enlarger>,
    shadows: Option<ShadowMaps>,
    /// Ordered by use, the last used at the end.
    targets: Vec<Targets>,
    /// The finished picture.
    picture: Option<wgpu::Texture>,
    readbacks: Readbacks,
    stages: u64,
    /// Ends of frames that the device may not have reached yet.
    ends: std::collections::VecDeque<wgpu::SubmissionIndex>,
}

/// The device, its queue and its last error.
pub(crate) struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    adapter: String,
    /// Whether the adapter uses OpenGL; its shaders cannot write which samples of a pixel they
    /// cover, among other limits.
    opengl: bool,
    /// Whether hidden spheres are culled on the CPU, as for software drivers.
    choosy: bool,
    /// Whether fragment stages take the numbers of uniforms as inputs, as for software drivers.
    flat_inputs: bool,
    /// Commands that are not submitted yet.
    recorded: Mutex<Vec<wgpu::CommandBuffer>>,
    complaint: Arc<Mutex<Option<String>>>,
    lost: Arc<Mutex<Option<String>>>,
}

impl Renderer {
    /// Finds an adapter (a graphics card, or a software driver) and prepares it. No global state is
    /// changed.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`] if the machine has none: the caller can continue without
    /// pictures. [`RenderError::Device`] if the adapter fails.
    pub fn new() -> Result<Self, RenderError> {
        Renderer::on(pollster::block_on(first_adapter())?)
    }

    /// Prepares the first adapter whose name, kind or interface contains a text, in any case: of Vulkan,
    /// otherwise of OpenGL. `None` takes any.
    ///
    /// # Errors
    /// [`RenderError::NoSuchAdapter`] with the names of all, and as [`Renderer::new`].
    pub fn with_adapter(name: Option<&str>) -> Result<Self, RenderError> {
        let Some(name) = name else { return Renderer::new() };
        let mut present = Vec::new();
        for backends in [wgpu::Backends::VULKAN, wgpu::Backends::GL] {
            let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
            descriptor.backends = backends;
            let all = pollster::block_on(wgpu::Instance::new(descriptor).enumerate_adapters(backends));
            if let Some(adapter) = choose(all, name, &mut present) {
                return Renderer::on(adapter);
            }
        }
        Err(no_such_adapter(name, present))
    }

    /// Prepares an adapter.
    fn on(adapter: wgpu::Adapter) -> Result<Self, RenderError> {
        let gpu = pollster::block_on(Gpu::open(adapter))?;
        let pipelines = Pipelines::new(&gpu.device, !gpu.opengl, gpu.flat_inputs);
        let finisher = Finisher::new(&gpu);
        let textures = TextureCache::new(&gpu, &pipelines.texture_layout);
        gpu.complaint()?;
        Ok(Renderer {
            gpu,
            pipelines,
            meshes: MeshCache::default(),
            textures,
            finisher,
            enlarger: None,
            shadows: None,
            targets: Vec::new(),
            picture: None,
            readbacks: Readbacks::default(),
            stages: 0,
            ends: Default::default(),
        })
    }

    /// The adapter in use: its name, kind and interface.
    pub fn adapter(&self) -> &str {
        &self.gpu.adapter
    }

    /// Whether the adapter is a software driver; [`Quality::fast`](crate::Quality::fast) is made for
    /// those.
    pub fn is_software(&self) -> bool {
        self.gpu.choosy
    }

    /// Draws the list into a picture of `width` x `height` pixels.
    ///
    /// # Errors
    /// A size or a list that cannot be drawn, or a device that fails. The renderer stays usable
    /// unless the device is lost.
    pub fn render(&mut self, list: &DrawList, width: u32, height: u32) -> Result<Image, RenderError> {
        self.render_from(&list.camera, list, width, height)
    }

    /// Draws the list from another viewpoint than its camera.
    ///
    /// # Errors
    /// As [`Renderer::render`], or an invalid viewpoint.
    pub fn render_from(
        &mut self,
        from: &dyn Viewpoint,
        list: &DrawList,
        width: u32,
        height: u32,
    ) -> Result<Image, RenderError> {
        self.draw(from, list, width, height)?;
        self.read()
    }

    /// Draws a picture and leaves it on the device: a window can show it ([`Renderer::picture`]),
    /// and [`Renderer::read`] copies it into memory. Does not wait for the device.
    ///
    /// # Errors
    /// As [`Renderer::render_from`].
    pub fn draw(&mut self, from: &dyn Viewpoint, list: &DrawList, width: u32, height: u32) -> Result<(), RenderError> {
        self.check_size(width, height)?;
        list.validate()?;
        let lens = from.lens(width as f32 / height as f32)?;
        let projection: Matrix4<f32> = (lens.projection * lens.view).cast();
        // views that are parts of a whole fit shadows and occlusion to the whole world, which is
        // the same for all of them
        let seen = if lens.part.is_some() { list.whole_box() } else { list.visible_box(&projection) };
        let stage = self.sent(list, seen.as_ref(), lens.part.is_some())?;
        self.draw_lens(&stage, lens, width, height)
    }

    /// Sends a list to the device, to be drawn from several viewpoints with
    /// [`Renderer::draw_stage`].
    ///
    /// # Errors
    /// A list that cannot be drawn, or a device that fails.
    pub fn stage(&mut self, list: &DrawList) -> Result<Stage, RenderError> {
        list.validate()?;
        self.sent(list, list.whole_box().as_ref(), true)
    }

    /// Draws a list that [`Renderer::stage`] has sent, as [`Renderer::draw`] does.
    ///
    /// # Errors
    /// A size that cannot be drawn, an invalid viewpoint, or a device that fails.
    pub fn draw_stage(
        &mut self,
        stage: &Stage,
        from: &dyn Viewpoint,
        width: u32,
        height: u32,
    ) -> Result<(), RenderError> {
        self.check_size(width, height)?;
        let lens = from.lens(width as f32 / height as f32)?;
        self.draw_lens(stage, lens, width, height)
    }

    /// The last picture, on the device: 8-bit sRGB with alpha, rows from the top.
    pub fn picture(&self) -> Option<&wgpu::Texture> {
        self.picture.as_ref()
    }

    /// Copies the last picture into memory. Waits for the device.
    ///
    /// # Errors
    /// A device that fails or hangs, or no picture yet.
    pub fn read(&self) -> Result<Image, RenderError> {
        let image = self.begin_read()?.finish();
        self.gpu.complaint()?;
        image
    }

    /// Begins to copy the last picture into memory. Further pictures may be drawn meanwhile, and any
    /// thread may wait for this one ([`Reading::finish`]).
    ///
    /// # Errors
    /// No picture yet, or a device that has failed.
    pub fn begin_read(&self) -> Result<Reading, RenderError> {
        let picture = self.picture.as_ref().ok_or_else(|| self.gpu.failed("no picture was drawn yet".into()))?;
        let reading = Reading::begin(&self.gpu, &self.readbacks, picture);
        self.gpu.complaint()?;
        Ok(reading)
    }

    /// Submits all pictures that are recorded.
    pub(crate) fn submit(&self) -> Result<(), RenderError> {
        self.gpu.submit();
        self.gpu.complaint()
    }

    /// Waits until the device has finished its work.
    ///
    /// # Errors
    /// A device that fails, is lost, or hangs.
    pub fn wait(&self) -> Result<(), RenderError> {
        targets::wait(&self.gpu)
    }

    /// Ends a frame and waits until the device is at most `ahead` frames behind. With 1, the next
    /// list is made while the device draws this one.
    ///
    /// # Errors
    /// As [`Renderer::wait`].
    pub fn end_frame(&mut self, ahead: usize) -> Result<(), RenderError> {
        self.ends.push_back(self.gpu.submit());
        while self.ends.len() > ahead {
            targets::wait_for(&self.gpu, self.ends.pop_front())?;
        }
        self.gpu.complaint()
    }

    fn sent(&mut self, list: &DrawList, seen: Option<&Bounds>, part: bool) -> Result<Stage, RenderError> {
        self.stages += 1;
        let textures = self.textures.sync(&self.gpu, &self.pipelines.texture_layout, &list.textures)?;
        let bound = Textures { white: self.textures.white.clone(), list: textures };
        let stage = Stage::new(&self.gpu, &mut self.pipelines, &mut self.meshes, bound, list, seen, part, self.stages)?;
        self.gpu.complaint()?;
        Ok(stage)
    }

    /// Draws all pixels of a view, including the rim of its lens, and keeps the middle.
    fn draw_lens(&mut self, stage: &Stage, lens: Lens, width: u32, height: u32) -> Result<(), RenderError> {
        let (drawn, rim) = self.draw_with_rim(stage, lens, width, height)?;
        self.picture = Some(match rim {
            0 => drawn.texture,
            _ => self.finisher.cut(&self.gpu, &drawn.texture, rim),
        });
        self.submit()
    }

    /// Records a view, drawn with fewer pixels and enlarged if the stage says so. Returns the picture with its rim, and
    /// the width of the rim in pixels.
    fn draw_with_rim(
        &mut self,
        stage: &Stage,
        mut lens: Lens,
        width: u32,
        height: u32,
    ) -> Result<(Drawn, u32), RenderError> {
        // only occlusion reads beyond the edge
        let rim = lens.part.map_or(0, |part| if stage.reach > 0.0 { part.rim_px } else { 0 });
        lens.part = lens.part.map(|part| Part { rim_px: rim, ..part });
        if rim > 0 {
            self.check_size(width + 2 * rim, height + 2 * rim)?;
            lens = lens.widened(width, height, rim);
        }
        let mut encoder =
            self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        let whole = [width + 2 * rim, height + 2 * rim];
        let [across, down] = if stage.half { whole.map(enlarge::half) } else { whole };
        if stage.half {
            lens.part =
                lens.part.map(|part| Part { first_pixel: part.first_pixel.map(|pixel| pixel.div_euclid(2)), ..part });
        }
        self.want_targets(across, down, stage.variant.samples);
        let targets = &self.targets[self.targets.len() - 1]; // put there by the line above
        let (size, count) = (stage.shadow_map_size, stage.shadow_views.len());
        let maps = match self.shadows.take().filter(|maps| maps.fits(size, count)) {
            Some(maps) => self.shadows.insert(maps),
            None => self.shadows.insert(ShadowMaps::new(&self.gpu, size, count)),
        };
        if maps.drawn != stage.serial {
            stage.draw_shadows(&mut encoder, &self.pipelines, maps);
            maps.drawn = stage.serial;
        }
        let frame = Frame::new(&self.gpu, &self.pipelines, stage, maps, targets, &lens)?;
        self.gpu.complaint()?;
        frame.draw(&mut encoder, &self.pipelines);
        let drawn = match stage.half {
            false => targets.drawn(),
            true => self.enlarger.get_or_insert_with(|| Enlarger::new(&self.gpu)).enlarge(
                &self.gpu,
                &mut encoder,
                targets,
                whole,
            ),
        };
        self.gpu.record(encoder.finish());
        self.gpu.complaint()?;
        Ok((drawn, rim))
    }

    /// Records the view of one eye, finished for its projector, at its place in the whole picture of this
    /// size. [`submit`](Self::submit) follows.
    pub(crate) fn draw_placed(
        &mut self,
        stage: &Stage,
        from: &dyn Viewpoint,
        [width, height]: [u32; 2],
        placed: &Placed,
    ) -> Result<(), RenderError> {
        self.check_size(width, height)?;
        self.check_size(placed.whole_px[0], placed.whole_px[1])?;
        let lens = from.lens(width as f32 / height as f32)?;
        let (drawn, rim) = self.draw_with_rim(stage, lens, width, height)?;
        self.picture = Some(self.finisher.place(&self.gpu, &drawn, rim, [width, height], placed)?);
        self.gpu.complaint()
    }

    /// Records the view of a face of the cube of pictures in its tile, `side` pixels wide, at a place
    /// of the picture of all tiles. [`submit`](Self::submit) follows.
    pub(crate) fn draw_face(
        &mut self,
        stage: &Stage,
        from: &dyn Viewpoint,
        side: u32,
        [whole_px, at_px]: [[u32; 2]; 2],
    ) -> Result<(), RenderError> {
        self.check_size(whole_px[0], whole_px[1])?;
        let (drawn, rim) = self.draw_with_rim(stage, from.lens(1.0)?, side, side)?;
        self.finisher.place_face(&self.gpu, &drawn, rim, side, [whole_px, at_px]);
        self.gpu.complaint()
    }

    /// Records a picture on a curved screen from the faces recorded before, at its place in the whole
    /// picture. [`submit`](Self::submit) follows.
    pub(crate) fn place_surface(&mut self, around: Around, size: [u32; 2], placed: &Placed) -> Result<(), RenderError> {
        self.check_size(placed.whole_px[0], placed.whole_px[1])?;
        self.picture = Some(self.finisher.place_surface(&self.gpu, around, size, placed)?);
        self.gpu.complaint()
    }

    /// Makes the targets of this size the last ones.
    fn want_targets(&mut self, width: u32, height: u32, samples: u32) {
        match self.targets.iter().position(|t| t.fits(width, height, samples)) {
            Some(i) => self.targets[i..].rotate_left(1),
            None => {
                // old targets are freed before new ones are allocated
                let new = u64::from(width) * u64::from(height);
                while !self.targets.is_empty()
                    && new + self.targets.iter().map(Targets::pixels).sum::<u64>() > KEPT_PIXELS
                {
                    self.targets.remove(0);
                }
                self.targets.push(Targets::new(&self.gpu, width, height, samples));
            }
        }
    }

    fn check_size(&self, width: u32, height: u32) -> Result<(), RenderError> {
        let limits = self.gpu.device.limits();
        let max_side = MAX_SIDE.min(limits.max_texture_dimension_2d);
        let max_pixels = MAX_PIXELS.min(limits.max_buffer_size / 4);
        let sides = 1..=max_side;
        if sides.contains(&width)
            && sides.contains(&height)
            && u64::from(width.next_multiple_of(64)) * u64::from(height) <= max_pixels
        {
            return Ok(());
        }
        Err(RenderError::BadSize { width, height, max_side, max_pixels })
    }
}

impl Gpu {
    async fn open(adapter: wgpu::Adapter) -> Result<Gpu, RenderError> {
        Gpu::open_with(adapter, wgpu::Features::empty()).await
    }

    /// Opens an adapter with features beyond those that every device has.
    async fn open_with(adapter: wgpu::Adapter, features: wgpu::Features) -> Result<Gpu, RenderError> {
        let info = adapter.get_info();
        let name = full_name(&info);
        let mut limits = wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits());
        limits.max_buffer_size = adapter.limits().max_buffer_size;
        let lacking = features - adapter.features();
        if !lacking.is_empty() {
            return Err(RenderError::Device { adapter: name, reason: format!("it has no {lacking}") });
        }
        let opengl = info.backend == wgpu::Backend::Gl;
        let choosy = info.device_type == wgpu::DeviceType::Cpu;
        let inputs = adapter.limits().max_inter_stage_shader_variables;
        let flat_inputs = choosy && !opengl && inputs >= kept::INPUTS;
        if flat_inputs {
            limits.max_inter_stage_shader_variables = inputs;
        }
        let asked = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("tumble"),
                required_features: features,
                required_limits: limits,
                ..Default::default()
            })
            .await
            .map_err(|e| RenderError::Device { adapter: name.clone(), reason: e.to_string() })?;
        let complaint = Arc::new(Mutex::new(None));
        let note = complaint.clone();
        asked.0.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| one_line(&error.to_string()));
        }));
        let lost = Arc::new(Mutex::new(None));
        let note = lost.clone();
        asked.0.set_device_lost_callback(move |_, message| {
            let why = if message.is_empty() { String::new() } else { format!(" ({message})") };
            note.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .get_or_insert(format!("the device was lost{why}; a new renderer can be made"));
        });
        let (device, queue) = asked;
        let recorded = Mutex::default();
        Ok(Gpu { device, queue, adapter: name, opengl, choosy, flat_inputs, recorded, complaint, lost })
    }

    /// Keeps commands for the next [`submit`](Self::submit).
    fn record(&self, commands: wgpu::CommandBuffer) {
        self.recorded.lock().unwrap_or_else(PoisonError::into_inner).push(commands);
    }

    /// Submits all recorded commands together.
    fn submit(&self) -> wgpu::SubmissionIndex {
        let recorded = std::mem::take(&mut *self.recorded.lock().unwrap_or_else(PoisonError::into_inner));
        self.queue.submit(recorded)
    }

    /// Returns the first device error since the last call.
    fn complaint(&self) -> Result<(), RenderError> {
        // a loss is reported at the next poll
        let _ = self.device.poll(wgpu::PollType::Poll);
        let complaint = self.complaint.lock().unwrap_or_else(PoisonError::into_inner).take();
        if complaint.is_some() {
            // a lost device reports an error at once, and the loss when its last work is done
            let _ = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(LAST_WORK) });
        }
        let lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner).clone();
        lost.or(complaint).map_or(Ok(()), |reason| Err(self.failed(reason)))
    }

    pub(crate) fn failed(&self, reason: String) -> RenderError {
        RenderError::Device { adapter: self.adapter.clone(), reason }
    }
}

/// Returns name, kind and interface of an adapter.
fn full_name(info: &wgpu::AdapterInfo) -> String {
    format!("{} ({:?}, {:?})", info.name, info.device_type, info.backend)
}

/// Returns the first adapter with a text in its full name, in any case. Names of the others are added to
/// `present`.
fn choose(all: Vec<wgpu::Adapter>, text: &str, present: &mut Vec<String>) -> Option<wgpu::Adapter> {
    let text = text.to_lowercase();
    all.into_iter().find(|adapter| {
        let name = full_name(&adapter.get_info());
        let is_wanted = name.to_lowercase().contains(&text);
        present.push(name);
        is_wanted
    })
}

fn no_such_adapter(wanted: &str, present: Vec<String>) -> RenderError {
    let present = if present.is_empty() { "none".to_owned() } else { present.join(", ") };
    RenderError::NoSuchAdapter { wanted: wanted.to_owned(), present }
}

/// Joins a message of several lines into one.
fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Finds a Vulkan adapter, otherwise one of OpenGL. They are requested one after the other, so that
/// OpenGL's libraries are loaded only if needed.
async fn first_adapter() -> Result<wgpu::Adapter, RenderError> {
    let mut reasons = Vec::new();
    for (name, backends) in [("Vulkan", wgpu::Backends::VULKAN), ("OpenGL", wgpu::Backends::GL)] {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = backends;
        match wgpu::Instance::new(descriptor).request_adapter(&Default::default()).await {
            Ok(adapter) => return Ok(adapter),
            Err(wgpu::RequestAdapterError::NotFound { .. }) => reasons.push(format!("no {name} driver")),
            Err(e) => reasons.push(e.to_string()),
        }
    }
    Err(RenderError::NoAdapter { reason: reasons.join(", ") })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_device_is_an_error_and_no_hang() {
        let Ok(mut renderer) = Renderer::new() else { return };
        let list = DrawList::default();
        assert!(renderer.render(&list, 8, 8).is_ok());
        renderer.gpu.device.destroy();
        for _ in 0..2 {
            let error = renderer.render(&list, 8, 8).expect_err("the device is gone").to_string();
            assert!(error.contains("lost") && error.contains(renderer.adapter()), "{error}");
        }
    }
}
