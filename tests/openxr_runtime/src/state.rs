//! State of the runtime: one instance with one session, and the files that change what it does.

use openxr_sys::{ActionType, SessionState};
use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Environment variable with the folder of the files.
pub const FOLDER: &str = "TUMBLE_OPENXR_RUNTIME_FOLDER";
/// Inputs with a button, in the order of the bits of the file `held`.
pub const BUTTONS: [&str; 4] = [
    "/user/hand/left/input/select/click",
    "/user/hand/left/input/menu/click",
    "/user/hand/right/input/select/click",
    "/user/hand/right/input/menu/click",
];

/// Origin of a space.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    Stage,
    Local,
    View,
    /// The pose of an action at this hand.
    Action(u64, String),
}

/// The runtime. Handles are numbers that are used once; 0 is none.
#[derive(Default)]
pub struct State {
    handles: u64,
    pub instance: u64,
    pub headless: bool,
    pub session: u64,
    pub running: bool,
    pub attached: bool,
    pub events: VecDeque<SessionState>,
    /// Path k + 1 has text k.
    pub paths: Vec<String>,
    pub action_set: u64,
    pub actions: BTreeMap<u64, ActionType>,
    /// Actions with the inputs that the simple controller has for them.
    pub bindings: Vec<(u64, String)>,
    pub spaces: BTreeMap<u64, Place>,
    /// The held buttons at the last synchronization.
    pub held: u32,
}

impl State {
    /// Returns a new handle.
    pub fn handle(&mut self) -> u64 {
        self.handles += 1;
        self.handles
    }

    /// Ends session or instance; handles are not used again.
    pub fn forget(&mut self, instance_too: bool) {
        let handles = self.handles;
        let State { instance, headless, paths, action_set, actions, bindings, .. } = std::mem::take(self);
        *self = match instance_too {
            true => State { handles, ..State::default() },
            false => State { handles, instance, headless, paths, action_set, actions, bindings, ..State::default() },
        };
    }

    /// Returns the input of an action at a hand.
    pub fn input(&self, action: u64, hand: &str) -> Option<&str> {
        let at_hand = |(of, path): &&(u64, String)| *of == action && path.starts_with(hand);
        self.bindings.iter().find(at_hand).map(|(_, path)| path.as_str())
    }
}

static STATE: Mutex<Option<State>> = Mutex::new(None);

/// Calls a function with the state.
pub fn with<T>(function: impl FnOnce(&mut State) -> T) -> T {
    let mut state: MutexGuard<'_, Option<State>> = STATE.lock().unwrap_or_else(PoisonError::into_inner);
    function(state.get_or_insert_default())
}

fn file(name: &str) -> Option<PathBuf> {
    Some(PathBuf::from(std::env::var_os(FOLDER)?).join(name))
}

/// Returns whether a file is there.
pub fn wants(name: &str) -> bool {
    file(name).is_some_and(|file| file.exists())
}

/// Returns the number of the file `held`; 0 without it.
pub fn held() -> u32 {
    file("held").and_then(|file| std::fs::read_to_string(file).ok()?.trim().parse().ok()).unwrap_or(0)
}
