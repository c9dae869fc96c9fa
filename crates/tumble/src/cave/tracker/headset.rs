//! A session of OpenXR without graphics (`XR_MND_headless`): head and hands of a headset, by the runtime that is
//! active on this machine. Nothing is drawn into the headset.
//!
//! | | from |
//! |---|---|
//! | head | the space `VIEW`, between the eyes |
//! | hands | the pose `grip` of `/user/hand/left` and `/user/hand/right` |
//! | wand | the pose `aim` of the right hand, whose −z is the direction; y of the cave after the turn of the axes |
//! | buttons, bits 0 to 3 | select and menu of the right hand, select and menu of the left one |
//!
//! Poses are those of the present time (`XR_KHR_convert_timespec_time`) in `STAGE`, whose origin is on the floor, or in
//! `LOCAL` (the head at the beginning) if the runtime has no `STAGE`. The axes of both are x to the right, y up, z back.
//! Source: the OpenXR specification 1.0, §§ 7 to 9 and 11.

use openxr::{
    Action, ActionSet, ActiveActionSet, ApplicationInfo, Binding, Entry, Event, EventDataBuffer, ExtensionSet,
    FormFactor, Headless, Instance, Path, Posef, ReferenceSpaceType, Session, SessionState, Space, SpaceLocation,
    SpaceLocationFlags, ViewConfigurationType,
};
use std::time::{Duration, Instant};

/// Time that a runtime has to begin a session.
const READY_TIMEOUT: Duration = Duration::from_secs(10);
/// Maximum number of events that are read at a time.
const MAX_EVENTS: usize = 64;
const HANDS: [&str; 2] = [openxr::USER_HAND_LEFT, openxr::USER_HAND_RIGHT];

/// Profiles of controllers, with the inputs for select and for menu of the left and of the right hand. A hand without a
/// menu button has B instead.
const PROFILES: [(&str, &str, [&str; 2]); 5] = [
    ("khr/simple_controller", "select/click", ["menu/click", "menu/click"]),
    ("oculus/touch_controller", "trigger/value", ["menu/click", "b/click"]),
    ("valve/index_controller", "trigger/click", ["b/click", "b/click"]),
    ("htc/vive_controller", "trigger/click", ["menu/click", "menu/click"]),
    ("microsoft/motion_controller", "trigger/value", ["menu/click", "menu/click"]),
];

/// The OpenXR runtime of this machine.
pub struct Runtime {
    entry: Entry,
}

impl Runtime {
    /// Loads the runtime by the loader of this machine, or from another library with the functions of a loader.
    ///
    /// # Errors
    /// What is missing, and what to install.
    #[allow(unsafe_code)]
    pub fn load(library: Option<&std::path::Path>) -> Result<Runtime, String> {
        // SAFETY: the library is the loader that this machine's system or user has installed under its fixed name, or
        // that of a test; both implement OpenXR.
        let loaded = unsafe {
            match library {
                Some(library) => Entry::load_from(library, &()),
                None => Entry::load(&()),
            }
        };
        let entry = loaded.map_err(|e| {
            let why = cause(&e);
            format!("there is no loader ({why}); install it (libopenxr-loader1 on Debian) and the headset's runtime")
        })?;
        let has = entry.enumerate_extensions().map_err(|e| {
            format!("there is no runtime ({e}); install that of the headset and make it the active one (XR_RUNTIME_JSON, or active_runtime.json in the folder openxr/1 of the configuration)")
        })?;
        if !has.mnd_headless || !has.khr_convert_timespec_time {
            let missing = if has.mnd_headless { "XR_KHR_convert_timespec_time" } else { "XR_MND_headless" };
            return Err(format!(
                "the runtime has no {missing}; expected one that tracks without drawing, such as Monado"
            ));
        }
        Ok(Runtime { entry })
    }
}

/// Poses and buttons at one time. A pose is `x y z qx qy qz qw` in m, x to the right, y up, z back; `None` where the
/// runtime does not know it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Between the eyes.
    pub head: Option<[f64; 7]>,
    /// Palms of the left and of the right hand.
    pub hands: [Option<[f64; 7]>; 2],
    /// The right hand's ray; it points along −z.
    pub wand: Option<[f64; 7]>,
    /// Held buttons, by bits.
    pub buttons: u32,
}

/// A session with a headset.
pub struct HeadsetSession {
    instance: Instance,
    session: Session<Headless>,
    actions: Actions,
    paths: [Path; 2],
    base: Space,
    has_stage: bool,
    view: Space,
    grips: [Space; 2],
    aim: Space,
    running: bool,
    /// Time since which the runtime could begin the session.
    waits_since: Instant,
}

impl HeadsetSession {
    /// Creates a session. It begins when the runtime is ready.
    ///
    /// # Errors
    /// The call that failed, and the reason of the runtime.
    #[allow(unsafe_code)]
    pub fn open(runtime: &Runtime) -> Result<HeadsetSession, String> {
        let mut needed = ExtensionSet::default();
        (needed.mnd_headless, needed.khr_convert_timespec_time) = (true, true);
        let about = ApplicationInfo { application_name: "tumble", ..ApplicationInfo::default() };
        let instance =
            runtime.entry.create_instance(&about, &needed, &[], &()).map_err(failed("the runtime does not start"))?;
        let system = instance.system(FormFactor::HEAD_MOUNTED_DISPLAY).map_err(failed("there is no headset"))?;
        // SAFETY: a session without graphics has no handles of a graphics interface that could be wrong.
        let created = unsafe { instance.create_session::<Headless>(system, &openxr::headless::SessionCreateInfo {}) };
        let (session, _, _) = created.map_err(failed("no session"))?;
        let paths = HANDS.map(|hand| instance.string_to_path(hand));
        let paths = [paths[0].map_err(failed("no left hand"))?, paths[1].map_err(failed("no right hand"))?];
        let actions = Actions::attach(&instance, &session, paths).map_err(failed("no actions"))?;
        let has_stage =
            session.enumerate_reference_spaces().map_err(failed("no spaces"))?.contains(&ReferenceSpaceType::STAGE);
        let fixed = if has_stage { ReferenceSpaceType::STAGE } else { ReferenceSpaceType::LOCAL };
        let space = |kind| session.create_reference_space(kind, Posef::IDENTITY).map_err(failed("no space"));
        let of_hand = |action: &Action<Posef>, hand| {
            action.create_space(&session, hand, Posef::IDENTITY).map_err(failed("no space of a hand"))
        };
        let (base, view) = (space(fixed)?, space(ReferenceSpaceType::VIEW)?);
        let grips = [of_hand(&actions.grip, paths[0])?, of_hand(&actions.grip, paths[1])?];
        let aim = of_hand(&actions.aim, paths[1])?;
        let (running, waits_since) = (false, Instant::now());
        Ok(HeadsetSession {
            instance,
            session,
            actions,
            paths,
            base,
            has_stage,
            view,
            grips,
            aim,
            running,
            waits_since,
        })
    }

    /// Returns a line for the user: runtime, and origin of its poses.
    pub fn describe(&self) -> String {
        let name = self.instance.properties().map_or_else(|_| "a runtime".to_owned(), |about| about.runtime_name);
        let origin = if self.has_stage { "on the floor (STAGE)" } else { "at the head's first place (LOCAL)" };
        format!("{name} is connected; its origin is {origin}")
    }

    /// Returns poses and buttons of this moment; `None` while the session does not run.
    ///
    /// # Errors
    /// The session is lost, or the runtime does not begin it in time.
    pub fn sample(&mut self) -> Result<Option<Sample>, String> {
        self.follow_events()?;
        if !self.running {
            return match self.waits_since.elapsed() > READY_TIMEOUT {
                true => Err(format!("the runtime does not begin the session for {} s", READY_TIMEOUT.as_secs())),
                false => Ok(None),
            };
        }
        self.located().map(Some).map_err(failed("the session is lost"))
    }

    fn located(&self) -> openxr::Result<Sample> {
        let now = self.instance.now()?;
        self.session.sync_actions(&[ActiveActionSet::new(&self.actions.set)])?;
        let pose = |space: &Space| space.locate(&self.base, now).map(|location| numbers(&location));
        let mut buttons = 0;
        let held =
            [(&self.actions.select, 1), (&self.actions.menu, 1), (&self.actions.select, 0), (&self.actions.menu, 0)];
        for (bit, (action, hand)) in held.into_iter().enumerate() {
            let state = action.state(&self.session, self.paths[hand])?;
            buttons |= u32::from(state.is_active && state.current_state) << bit;
        }
        let hands = [pose(&self.grips[0])?, pose(&self.grips[1])?];
        Ok(Sample { head: pose(&self.view)?, hands, wand: pose(&self.aim)?, buttons })
    }

    /// Begins and ends the session as the runtime wants.
    fn follow_events(&mut self) -> Result<(), String> {
        let mut storage = EventDataBuffer::new();
        for _ in 0..MAX_EVENTS {
            let state = match self.instance.poll_event(&mut storage).map_err(failed("the runtime is lost"))? {
                None => return Ok(()),
                Some(Event::SessionStateChanged(change)) => change.state(),
                Some(Event::InstanceLossPending(_)) => return Err("the runtime ends".into()),
                Some(_) => continue,
            };
            match state {
                SessionState::READY => {
                    let kind = ViewConfigurationType::PRIMARY_STEREO;
                    self.session.begin(kind).map_err(failed("the session does not begin"))?;
                    self.running = true;
                }
                SessionState::STOPPING => {
                    self.session.end().map_err(failed("the session does not end"))?;
                    (self.running, self.waits_since) = (false, Instant::now());
                }
                SessionState::LOSS_PENDING => return Err("the session is lost".into()),
                SessionState::EXITING => return Err("the runtime has ended the session".into()),
                _ => {}
            }
        }
        Ok(())
    }
}

/// Actions of both hands.
struct Actions {
    set: ActionSet,
    grip: Action<Posef>,
    aim: Action<Posef>,
    select: Action<bool>,
    menu: Action<bool>,
}

impl Actions {
    /// Makes the actions of a session, with inputs of the known controllers.
    fn attach(instance: &Instance, session: &Session<Headless>, paths: [Path; 2]) -> openxr::Result<Actions> {
        let set = instance.create_action_set("hands", "Hands", 0)?;
        let actions = Actions {
            grip: set.create_action("grip", "Hand", &paths)?,
            aim: set.create_action("aim", "Wand", &paths)?,
            select: set.create_action("select", "Select", &paths)?,
            menu: set.create_action("menu", "Menu", &paths)?,
            set,
        };
        let mut suggested = Vec::new();
        for profile in PROFILES {
            suggested.push(actions.suggest(instance, profile));
        }
        // each runtime knows the first profile; the others make better use of a controller
        suggested.swap_remove(0)?;
        session.attach_action_sets(&[&actions.set])?;
        Ok(actions)
    }

    fn suggest(&self, instance: &Instance, (profile, select, menus): (&str, &str, [&str; 2])) -> openxr::Result<()> {
        let mut bindings = Vec::new();
        for (hand, menu) in HANDS.into_iter().zip(menus) {
            let input = |name: &str| instance.string_to_path(&format!("{hand}/input/{name}"));
            bindings.extend([
                Binding::new(&self.grip, input("grip/pose")?),
                Binding::new(&self.aim, input("aim/pose")?),
                Binding::new(&self.select, input(select)?),
                Binding::new(&self.menu, input(menu)?),
            ]);
        }
        let profile = instance.string_to_path(&format!("/interaction_profiles/{profile}"))?;
        instance.suggest_interaction_profile_bindings(profile, &bindings)
    }
}

/// Returns position and rotation if both are known.
fn numbers(location: &SpaceLocation) -> Option<[f64; 7]> {
    let whole = SpaceLocationFlags::POSITION_VALID | SpaceLocationFlags::ORIENTATION_VALID;
    let (p, q) = (location.pose.position, location.pose.orientation);
    location.location_flags.contains(whole).then(|| [p.x, p.y, p.z, q.x, q.y, q.z, q.w].map(f64::from))
}

/// Returns the first cause of an error.
fn cause(error: &dyn std::error::Error) -> String {
    error.source().map_or_else(|| error.to_string(), cause)
}

/// Adds what failed to the reason of the runtime.
fn failed(what: &str) -> impl Fn(openxr::sys::Result) -> String + '_ {
    move |why| format!("{what} ({why})")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{SystemTime, UNIX_EPOCH};

    fn now_s() -> f64 {
        (SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() % 20_000_000_000) as f64 * 1e-9
    }

    /// The runtime's head goes around a circle of 0.5 m in 20 s, at a height of 1.625 m. Each pose lies between those of
    /// the times before and after the call.
    #[test]
    fn poses_are_those_of_the_moment() {
        let library = std::env::current_exe().unwrap().with_file_name("libtumble_openxr_runtime.so");
        let runtime = Runtime::load(Some(&library)).unwrap();
        let mut session = HeadsetSession::open(&runtime).unwrap();
        assert_eq!(session.describe(), "circle is connected; its origin is on the floor (STAGE)");
        for _ in 0..100 {
            let before = now_s();
            let sample = session.sample().unwrap().unwrap();
            let taken = (now_s() - before).rem_euclid(20.0);
            let [x, y, z, qx, qy, qz, qw] = sample.head.unwrap();
            // y is up: a turn to the left goes from x to −z
            let turned = (-z).atan2(x);
            let since = (turned * 20.0 / std::f64::consts::TAU - before).rem_euclid(20.0);
            // single precision: 2e-7 rad are 6e-7 s
            assert!(since <= taken + 1e-6 || since > 20.0 - 1e-6, "{since} s of {taken} s");
            assert!((x.hypot(z) - 0.5).abs() < 1e-6 && y == 1.625 && qx == 0.0 && qz == 0.0);
            assert!((2.0 * qy.atan2(qw) - turned).sin().abs() < 1e-6 && (qy.hypot(qw) - 1.0).abs() < 1e-6);
            assert_eq!(sample.hands[0], Some([-0.25, 1.0, -1.5, 0.0, 0.0, 0.0, 1.0]));
            assert_eq!(sample.hands[1], Some([0.5, 1.25, -0.75, 1.0, 0.0, 0.0, 0.0]));
            assert_eq!((sample.wand, sample.buttons), (Some([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]), 0));
        }
        // one session at a time, and the first one is over when it is dropped
        let second = HeadsetSession::open(&runtime).err().unwrap();
        assert!(second.starts_with("the runtime does not start ("), "{second}");
        drop(session);
        assert!(HeadsetSession::open(&runtime).unwrap().sample().unwrap().is_some());
    }

    #[test]
    fn a_machine_without_a_loader_says_how_to_get_one() {
        let said = Runtime::load(Some("/nonexistent/libopenxr_loader.so.1".as_ref())).err().unwrap();
        assert!(said.starts_with("there is no loader (") && said.contains("libopenxr-loader1 on Debian"), "{said}");
    }
}
