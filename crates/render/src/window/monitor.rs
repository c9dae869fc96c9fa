//! The monitor of a window, and its video mode.

use super::WindowOptions;
use crate::RenderError;
use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::monitor::{MonitorHandle, VideoModeHandle};

/// Difference of a monitor's refresh rate from the wanted one that is accepted, Hz: 59.94 is 60.
const RATE_TOLERANCE_HZ: f64 = 0.5;
/// Largest number of video modes that an error names.
const MAX_NAMED: usize = 24;

/// Size (pixels), rate (mHz) and depth of color (bits) of a video mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Mode {
    size_px: [u32; 2],
    rate_millihertz: u32,
    color_bits: u16,
}

/// Returns the monitor that the options name, or for a full screen the primary one, and checks it. `None` if
/// they need none.
pub(super) fn find(
    event_loop: &ActiveEventLoop,
    options: &WindowOptions,
) -> Result<Option<MonitorHandle>, RenderError> {
    let found = match &options.monitor {
        Some(wanted) => {
            let named = event_loop.available_monitors().find(|monitor| name(monitor) == *wanted);
            Some(named.ok_or_else(|| {
                let present: Vec<String> = event_loop.available_monitors().map(|monitor| name(&monitor)).collect();
                RenderError::Monitor(format!("there is no monitor \"{wanted}\"; there are: {}", present.join(", ")))
            })?)
        }
        None if options.full_screen || options.refresh_hz.is_some() => {
            let first = event_loop.primary_monitor().or_else(|| event_loop.available_monitors().next());
            Some(first.ok_or_else(|| RenderError::Monitor("the desktop has no monitor".into()))?)
        }
        None => None,
    };
    let Some(monitor) = found else { return Ok(None) };
    if sets_mode(options) {
        return Ok(Some(monitor)); // a video mode decides
    }
    let (PhysicalSize { width, height }, [w, h]) = (monitor.size(), options.size_px);
    if options.full_screen && [width, height] != [w, h] {
        return Err(RenderError::Monitor(format!(
            "monitor \"{}\" has {width} x {height} pixels and the full-screen picture {w} x {h}; expected the same",
            name(&monitor)
        )));
    }
    if let Some(wanted) = options.refresh_hz {
        let rate = monitor.refresh_rate_millihertz().map(hertz);
        if rate.is_none_or(|rate| (rate - wanted).abs() > RATE_TOLERANCE_HZ) {
            let has = rate.map_or("reports no refresh rate".into(), |rate| format!("has {rate:.2} Hz"));
            return Err(RenderError::Monitor(format!("monitor \"{}\" {has}, expected {wanted} Hz", name(&monitor))));
        }
    }
    Ok(Some(monitor))
}

/// Returns the video mode for a full screen with a refresh rate; `None` for others.
pub(super) fn video_mode(
    monitor: Option<&MonitorHandle>,
    options: &WindowOptions,
) -> Result<Option<VideoModeHandle>, RenderError> {
    let wanted = options.refresh_hz.filter(|_| sets_mode(options));
    let (Some(monitor), Some(wanted)) = (monitor, wanted) else { return Ok(None) };
    let mode = |mode: &VideoModeHandle| Mode {
        size_px: mode.size().into(),
        rate_millihertz: mode.refresh_rate_millihertz(),
        color_bits: mode.bit_depth(),
    };
    let handles: Vec<VideoModeHandle> = monitor.video_modes().collect();
    let modes: Vec<Mode> = handles.iter().map(mode).collect();
    match choose(&modes, options.size_px, wanted) {
        Some(k) => Ok(handles.into_iter().nth(k)),
        None => {
            let [w, h] = options.size_px;
            let has = listed(modes);
            let name = name(monitor);
            Err(RenderError::Monitor(format!(
                "monitor \"{name}\" has no mode of {w} x {h} at {wanted} Hz; it has {has}"
            )))
        }
    }
}

fn sets_mode(options: &WindowOptions) -> bool {
    options.full_screen && options.refresh_hz.is_some()
}

fn name(monitor: &MonitorHandle) -> String {
    monitor.name().unwrap_or_else(|| "without a name".into())
}

fn hertz(millihertz: u32) -> f64 {
    f64::from(millihertz) / 1000.0
}

/// Returns the index of the mode of this size with the closest rate within the tolerance, and of these the one
/// with most colors.
fn choose(modes: &[Mode], size_px: [u32; 2], wanted_hz: f64) -> Option<usize> {
    let away = |mode: &Mode| (hertz(mode.rate_millihertz) - wanted_hz).abs();
    let fits = |(_, mode): &(usize, &Mode)| mode.size_px == size_px && away(mode) <= RATE_TOLERANCE_HZ;
    let better = |a: &Mode, b: &Mode| away(a).total_cmp(&away(b)).then(b.color_bits.cmp(&a.color_bits));
    modes.iter().enumerate().filter(fits).min_by(|(_, a), (_, b)| better(a, b)).map(|(k, _)| k)
}

/// Returns the modes for an error: the largest and fastest first.
fn listed(mut modes: Vec<Mode>) -> String {
    modes.sort();
    modes.reverse();
    modes.dedup_by_key(|mode| (mode.size_px, mode.rate_millihertz));
    let text =
        |mode: &Mode| format!("{} x {} at {:.2} Hz", mode.size_px[0], mode.size_px[1], hertz(mode.rate_millihertz));
    let named: Vec<String> = modes.iter().take(MAX_NAMED).map(text).collect();
    match modes.len().saturating_sub(MAX_NAMED) {
        _ if modes.is_empty() => "none".into(),
        0 => named.join(", "),
        more => format!("{} and {more} more", named.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mode_has_the_size_the_closest_rate_and_most_colors() {
        let mode = |size_px, rate_millihertz, color_bits| Mode { size_px, rate_millihertz, color_bits };
        let (full, small) = ([1920, 1080], [1280, 720]);
        let modes = [
            mode(full, 60_000, 24),
            mode(full, 119_880, 16),
            mode(full, 119_880, 24),
            mode(full, 120_400, 24),
            mode(small, 120_000, 24),
            mode(small, 0, 24),
        ];
        assert_eq!(choose(&modes, full, 119.88), Some(2));
        assert_eq!(choose(&modes, full, 120.0), Some(2), "0.12 Hz away, not 0.4");
        assert_eq!(choose(&modes, full, 59.94), Some(0));
        assert_eq!(choose(&modes, small, 120.0), Some(4));
        assert_eq!((choose(&modes, full, 144.0), choose(&modes, [800, 600], 60.0)), (None, None));
        assert_eq!(
            listed(modes.to_vec()),
            "1920 x 1080 at 120.40 Hz, 1920 x 1080 at 119.88 Hz, 1920 x 1080 at 60.00 Hz, 1280 x 720 at 120.00 Hz, 1280 x 720 at 0.00 Hz"
        );
        assert_eq!(listed(Vec::new()), "none");
        let many = (0..30).map(|k| mode(full, 1000 * k, 24)).collect();
        assert!(listed(many).ends_with("1920 x 1080 at 6.00 Hz and 6 more"));
    }
}
