//! The state of a run as consoles show it. Names end with units.

use crate::cave::facet_report::BrowserReport;
use crate::cave::server::Difference;
use serde::Serialize;

/// The state of a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ConsoleStatus {
    pub scene: String,
    pub cave: String,
    /// Number of the last frame.
    pub frame: u64,
    pub simulated_s: f64,
    pub frames_per_s: f64,
    /// Time dropped because frames took longer than their length.
    pub behind_s: f64,
    /// Median simulation of a frame.
    pub simulation_ms: f64,
    /// Median time between the facets.
    pub skew_ms: Option<f64>,
    /// Median time from an input to the last facet that shows it.
    pub input_to_picture_ms: Option<f64>,
    /// Median time from taking the inputs for a frame to its presentation.
    pub frame_to_picture_ms: Option<f64>,
    /// Median time by which heads are predicted.
    pub tracker_lead_ms: Option<f64>,
    pub paused: bool,
    /// Whether recorded frames are shown.
    pub replaying: bool,
    /// The calibration pattern that facets show instead of the scene.
    pub pattern: Option<String>,
    /// File of the recording in progress.
    pub recording: Option<String>,
    pub facets: Vec<FacetStatus>,
    /// Everything that an operator must look at; empty if the run is well.
    pub alarms: Vec<String>,
}

/// The state of a facet.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FacetStatus {
    pub name: String,
    /// `absent`, `behind` or `in step`.
    pub membership: &'static str,
    /// The last frame that it drew or showed.
    pub frame: u64,
    pub frames_per_s: f64,
    /// From the arrival of the last frame to the end of drawing.
    pub draw_ms: f64,
    pub late: u64,
    pub missing: u64,
    pub dropped: u64,
    /// Packets that were sent again.
    pub repeated: u64,
    pub bytes_out: u64,
    /// Shown frames that are not written yet.
    pub waiting: u64,
    /// Pictures that the facet has looked at, and how many of them were black.
    pub pictures: u64,
    pub black: u64,
    /// Number of black pictures since the last one that was not.
    pub black_now: u64,
    /// First 16 bytes of the BLAKE3 hash of its last picture, hexadecimal; empty before the first.
    pub image: String,
    /// The web browsers that show it, if it is served to browsers.
    pub browsers: Option<BrowserReport>,
    /// The graphics adapter that draws it; empty if it draws nothing.
    pub adapter: String,
    /// The first frame in which a facet that steps the world by itself had another state.
    pub first_difference: Option<Difference>,
}

/// Number of black pictures in succession that are an alarm.
const BLACK_ALARM: u64 = 30;

impl FacetStatus {
    /// Returns the facet's alarms.
    pub fn alarms(&self) -> Vec<String> {
        let mut alarms = Vec::new();
        if self.membership != "in step" {
            alarms.push(format!("facet {} is {}", self.name, self.membership));
        }
        if self.black_now >= BLACK_ALARM {
            alarms.push(format!("facet {} shows black: the last {} pictures", self.name, self.black_now));
        }
        if let Some(Difference { frame, object }) = &self.first_difference {
            alarms
                .push(format!("facet {} computed another state: {object} differs first, in frame {frame}", self.name));
        }
        alarms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_black_screen_an_absent_facet_and_a_difference_are_alarms() {
        let well = FacetStatus { name: "f".into(), membership: "in step", black_now: 29, ..FacetStatus::default() };
        assert!(well.alarms().is_empty());
        let black = FacetStatus { black_now: 30, ..well.clone() };
        assert_eq!(black.alarms(), ["facet f shows black: the last 30 pictures"]);
        let absent = FacetStatus { membership: "absent", ..well.clone() };
        assert_eq!(absent.alarms(), ["facet f is absent"]);
        let first_difference = Some(Difference { frame: 7, object: "'ball'".into() });
        assert_eq!(FacetStatus { first_difference, ..well }.alarms().len(), 1);
    }
}
