//! The functions of OpenXR, as far as a program without pictures needs them.
//!
//! SAFETY of all of them: pointers are those of a caller that keeps to the specification.
#![allow(clippy::missing_safety_doc, clippy::undocumented_unsafe_blocks)]

use crate::motion::{self, AIM, HEIGHT_M, LEFT_HAND, RIGHT_HAND};
use crate::state::{BUTTONS, Place, State, held, wants, with};
use openxr_sys::{self as xr, Handle, Result};
use std::ffi::{CStr, c_char};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

const HEADLESS: &CStr = c"XR_MND_headless";
const TIMESPEC: &CStr = c"XR_KHR_convert_timespec_time";
/// The interaction profile of the controllers.
const PROFILE: &str = "/interaction_profiles/khr/simple_controller";
/// Profiles that the runtime knows and has no controllers of.
const OTHER_PROFILE: &str = "/interaction_profiles/oculus/touch_controller";
const SYSTEM: u64 = 1;

type Answer = std::result::Result<(), Result>;

fn code(answer: Answer) -> Result {
    answer.err().unwrap_or(Result::SUCCESS)
}

fn require(condition: bool, otherwise: Result) -> Answer {
    if condition { Ok(()) } else { Err(otherwise) }
}

/// Checks a handle of the only object of its kind.
fn is(handle: impl Handle, expected: u64) -> Answer {
    require(handle.into_raw() != 0 && handle.into_raw() == expected, Result::ERROR_HANDLE_INVALID)
}

/// Checks the session's handle, and that it is not lost.
fn lives(state: &State, session: xr::Session) -> Answer {
    is(session, state.session)?;
    require(!wants("lost"), Result::ERROR_SESSION_LOST)
}

fn place_text(out: &mut [c_char], text: &CStr) {
    out.iter_mut().zip(text.to_bytes_with_nul()).for_each(|(to, from)| *to = *from as c_char);
}

/// Answers with a list: its length if there is no room for it.
unsafe fn list<T: Copy>(values: &[T], capacity: u32, count: *mut u32, out: *mut T) -> Result {
    unsafe {
        count.write(values.len() as u32);
        if capacity == 0 {
            return Result::SUCCESS;
        }
        if (capacity as usize) < values.len() {
            return Result::ERROR_SIZE_INSUFFICIENT;
        }
        out.copy_from_nonoverlapping(values.as_ptr(), values.len());
    }
    Result::SUCCESS
}

fn path_text(state: &State, path: xr::Path) -> std::result::Result<String, Result> {
    let text = (path.into_raw() as usize).checked_sub(1).and_then(|k| state.paths.get(k));
    text.cloned().ok_or(Result::ERROR_PATH_INVALID)
}

/// Answers a function whose arguments are not looked at.
pub unsafe extern "system" fn unsupported() -> Result {
    Result::ERROR_FUNCTION_UNSUPPORTED
}

pub unsafe fn extensions(
    _layer: *const c_char,
    capacity: u32,
    count: *mut u32,
    out: *mut xr::ExtensionProperties,
) -> Result {
    let names: &[&CStr] = if wants("no_headless") { &[TIMESPEC] } else { &[TIMESPEC, HEADLESS] };
    unsafe {
        count.write(names.len() as u32);
        if capacity == 0 {
            return Result::SUCCESS;
        }
        if (capacity as usize) < names.len() {
            return Result::ERROR_SIZE_INSUFFICIENT;
        }
        for (k, name) in names.iter().enumerate() {
            let about = &mut *out.add(k);
            place_text(&mut about.extension_name, name);
            about.extension_version = 1;
        }
    }
    Result::SUCCESS
}

pub unsafe fn create_instance(about: *const xr::InstanceCreateInfo, out: *mut xr::Instance) -> Result {
    while wants("hang") {
        std::thread::sleep(Duration::from_millis(50));
    }
    let about = unsafe { &*about };
    let enabled: Vec<&CStr> = (0..about.enabled_extension_count as usize)
        .map(|k| unsafe { CStr::from_ptr(*about.enabled_extension_names.add(k)) })
        .collect();
    code(with(|state| {
        require(state.instance == 0, Result::ERROR_LIMIT_REACHED)?;
        let known = |name: &&CStr| *name == TIMESPEC || (*name == HEADLESS && !wants("no_headless"));
        require(enabled.iter().all(known), Result::ERROR_EXTENSION_NOT_PRESENT)?;
        state.headless = enabled.contains(&HEADLESS);
        state.instance = state.handle();
        unsafe { out.write(xr::Instance::from_raw(state.instance)) };
        Ok(())
    }))
}

pub unsafe extern "system" fn destroy_instance(instance: xr::Instance) -> Result {
    code(with(|state| {
        is(instance, state.instance)?;
        state.forget(true);
        Ok(())
    }))
}

pub unsafe extern "system" fn instance_properties(instance: xr::Instance, out: *mut xr::InstanceProperties) -> Result {
    code(with(|state| {
        is(instance, state.instance)?;
        let out = unsafe { &mut *out };
        out.runtime_version = xr::Version::new(1, 0, 0);
        place_text(&mut out.runtime_name, c"circle");
        Ok(())
    }))
}

pub unsafe extern "system" fn poll_event(instance: xr::Instance, out: *mut xr::EventDataBuffer) -> Result {
    with(|state| {
        if let Err(why) = is(instance, state.instance) {
            return why;
        }
        let Some(next) = state.events.pop_front() else { return Result::EVENT_UNAVAILABLE };
        let event = xr::EventDataSessionStateChanged {
            ty: xr::EventDataSessionStateChanged::TYPE,
            next: std::ptr::null(),
            session: xr::Session::from_raw(state.session),
            state: next,
            time: xr::Time::from_nanos(now_ns()),
        };
        unsafe { out.cast::<xr::EventDataSessionStateChanged>().write(event) };
        Result::SUCCESS
    })
}

pub unsafe extern "system" fn string_to_path(
    instance: xr::Instance,
    text: *const c_char,
    out: *mut xr::Path,
) -> Result {
    let text = unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned();
    code(with(|state| {
        is(instance, state.instance)?;
        require(text.starts_with('/') && !text.ends_with('/'), Result::ERROR_PATH_FORMAT_INVALID)?;
        let known = state.paths.iter().position(|path| *path == text);
        let k = known.unwrap_or_else(|| {
            state.paths.push(text);
            state.paths.len() - 1
        });
        unsafe { out.write(xr::Path::from_raw(k as u64 + 1)) };
        Ok(())
    }))
}

pub unsafe extern "system" fn get_system(
    instance: xr::Instance,
    about: *const xr::SystemGetInfo,
    out: *mut xr::SystemId,
) -> Result {
    let form = unsafe { (*about).form_factor };
    code(with(|state| {
        is(instance, state.instance)?;
        require(form == xr::FormFactor::HEAD_MOUNTED_DISPLAY, Result::ERROR_FORM_FACTOR_UNSUPPORTED)?;
        require(!wants("no_headset"), Result::ERROR_FORM_FACTOR_UNAVAILABLE)?;
        unsafe { out.write(xr::SystemId::from_raw(SYSTEM)) };
        Ok(())
    }))
}

pub unsafe extern "system" fn create_session(
    instance: xr::Instance,
    about: *const xr::SessionCreateInfo,
    out: *mut xr::Session,
) -> Result {
    let about = unsafe { &*about };
    code(with(|state| {
        is(instance, state.instance)?;
        require(about.system_id.into_raw() == SYSTEM, Result::ERROR_SYSTEM_INVALID)?;
        require(state.headless && about.next.is_null(), Result::ERROR_GRAPHICS_DEVICE_INVALID)?;
        require(state.session == 0, Result::ERROR_LIMIT_REACHED)?;
        require(!wants("lost"), Result::ERROR_RUNTIME_FAILURE)?;
        state.session = state.handle();
        state.events.push_back(xr::SessionState::IDLE);
        if !wants("idle") {
            state.events.push_back(xr::SessionState::READY);
        }
        unsafe { out.write(xr::Session::from_raw(state.session)) };
        Ok(())
    }))
}

pub unsafe extern "system" fn destroy_session(session: xr::Session) -> Result {
    code(with(|state| {
        is(session, state.session)?;
        state.forget(false);
        Ok(())
    }))
}

pub unsafe extern "system" fn begin_session(session: xr::Session, _about: *const xr::SessionBeginInfo) -> Result {
    code(with(|state| {
        lives(state, session)?;
        require(!state.running, Result::ERROR_SESSION_RUNNING)?;
        state.running = true;
        // without pictures the session has the focus at once
        let next = [xr::SessionState::SYNCHRONIZED, xr::SessionState::VISIBLE, xr::SessionState::FOCUSED];
        state.events.extend(next);
        Ok(())
    }))
}

pub unsafe extern "system" fn end_session(session: xr::Session) -> Result {
    code(with(|state| {
        lives(state, session)?;
        Err(Result::ERROR_SESSION_NOT_STOPPING)
    }))
}

pub unsafe extern "system" fn reference_spaces(
    session: xr::Session,
    capacity: u32,
    count: *mut u32,
    out: *mut xr::ReferenceSpaceType,
) -> Result {
    use xr::ReferenceSpaceType as Kind;
    if let Err(why) = with(|state| lives(state, session)) {
        return why;
    }
    let all = [Kind::VIEW, Kind::LOCAL, Kind::STAGE];
    unsafe { list(if wants("no_stage") { &all[..2] } else { &all }, capacity, count, out) }
}

pub unsafe extern "system" fn create_reference_space(
    session: xr::Session,
    about: *const xr::ReferenceSpaceCreateInfo,
    out: *mut xr::Space,
) -> Result {
    use xr::ReferenceSpaceType as Kind;
    let about = unsafe { &*about };
    code(with(|state| {
        lives(state, session)?;
        require(is_identity(&about.pose_in_reference_space), Result::ERROR_POSE_INVALID)?;
        let place = match about.reference_space_type {
            Kind::VIEW => Place::View,
            Kind::LOCAL => Place::Local,
            Kind::STAGE if !wants("no_stage") => Place::Stage,
            _ => return Err(Result::ERROR_REFERENCE_SPACE_UNSUPPORTED),
        };
        let space = state.handle();
        state.spaces.insert(space, place);
        unsafe { out.write(xr::Space::from_raw(space)) };
        Ok(())
    }))
}

pub unsafe extern "system" fn create_action_space(
    session: xr::Session,
    about: *const xr::ActionSpaceCreateInfo,
    out: *mut xr::Space,
) -> Result {
    let about = unsafe { &*about };
    code(with(|state| {
        lives(state, session)?;
        require(is_identity(&about.pose_in_action_space), Result::ERROR_POSE_INVALID)?;
        let action = about.action.into_raw();
        let kind = state.actions.get(&action).ok_or(Result::ERROR_HANDLE_INVALID)?;
        require(*kind == xr::ActionType::POSE_INPUT, Result::ERROR_ACTION_TYPE_MISMATCH)?;
        let place = Place::Action(action, path_text(state, about.subaction_path)?);
        let space = state.handle();
        state.spaces.insert(space, place);
        unsafe { out.write(xr::Space::from_raw(space)) };
        Ok(())
    }))
}

pub unsafe extern "system" fn destroy_space(space: xr::Space) -> Result {
    code(with(|state| state.spaces.remove(&space.into_raw()).map(drop).ok_or(Result::ERROR_HANDLE_INVALID)))
}

pub unsafe extern "system" fn locate_space(
    space: xr::Space,
    base: xr::Space,
    time: xr::Time,
    out: *mut xr::SpaceLocation,
) -> Result {
    code(with(|state| {
        let place = |space: xr::Space| state.spaces.get(&space.into_raw()).ok_or(Result::ERROR_HANDLE_INVALID);
        let (place, base) = (place(space)?, place(base)?);
        require(!wants("lost"), Result::ERROR_SESSION_LOST)?;
        require(time.as_nanos() > 0, Result::ERROR_TIME_INVALID)?;
        let floor_m = match base {
            Place::Stage => 0.0,
            Place::Local => HEIGHT_M as f32,
            _ => return Err(Result::ERROR_FEATURE_UNSUPPORTED),
        };
        let mut numbers = located(state, place, time.as_nanos());
        if let Some(numbers) = &mut numbers {
            numbers[1] -= floor_m;
        }
        let (position, orientation) =
            (xr::SpaceLocationFlags::POSITION_VALID, xr::SpaceLocationFlags::ORIENTATION_VALID);
        let out = unsafe { &mut *out };
        out.location_flags = if numbers.is_some() { position | orientation } else { xr::SpaceLocationFlags::EMPTY };
        out.pose = motion::pose(numbers.unwrap_or([f32::NAN, 1e9, -1e9, 7.0, 0.0, 0.0, 0.0]));
        Ok(())
    }))
}

/// Returns the numbers of a place in `STAGE`; `None` if it is not known.
fn located(state: &State, place: &Place, time_ns: i64) -> Option<[f32; 7]> {
    if wants("invalid") || !state.running {
        return None;
    }
    match place {
        Place::View => Some(motion::head(time_ns)),
        Place::Action(action, hand) if state.attached => match state.input(*action, hand)? {
            "/user/hand/left/input/grip/pose" => Some(LEFT_HAND),
            "/user/hand/right/input/grip/pose" => Some(RIGHT_HAND),
            "/user/hand/right/input/aim/pose" => Some(AIM),
            _ => None,
        },
        _ => None,
    }
}

pub unsafe extern "system" fn create_action_set(
    instance: xr::Instance,
    _about: *const xr::ActionSetCreateInfo,
    out: *mut xr::ActionSet,
) -> Result {
    code(with(|state| {
        is(instance, state.instance)?;
        require(state.action_set == 0, Result::ERROR_LIMIT_REACHED)?;
        state.action_set = state.handle();
        unsafe { out.write(xr::ActionSet::from_raw(state.action_set)) };
        Ok(())
    }))
}

pub unsafe extern "system" fn destroy_action_set(set: xr::ActionSet) -> Result {
    code(with(|state| {
        is(set, state.action_set)?;
        state.action_set = 0;
        Ok(())
    }))
}

pub unsafe extern "system" fn create_action(
    set: xr::ActionSet,
    about: *const xr::ActionCreateInfo,
    out: *mut xr::Action,
) -> Result {
    let about = unsafe { &*about };
    code(with(|state| {
        is(set, state.action_set)?;
        require(!state.attached, Result::ERROR_ACTIONSETS_ALREADY_ATTACHED)?;
        require(about.count_subaction_paths == 2, Result::ERROR_PATH_UNSUPPORTED)?;
        let action = state.handle();
        state.actions.insert(action, about.action_type);
        unsafe { out.write(xr::Action::from_raw(action)) };
        Ok(())
    }))
}

pub unsafe extern "system" fn destroy_action(action: xr::Action) -> Result {
    code(with(|state| state.actions.remove(&action.into_raw()).map(drop).ok_or(Result::ERROR_HANDLE_INVALID)))
}

pub unsafe extern "system" fn suggest_bindings(
    instance: xr::Instance,
    about: *const xr::InteractionProfileSuggestedBinding,
) -> Result {
    let about = unsafe { &*about };
    let suggested =
        unsafe { std::slice::from_raw_parts(about.suggested_bindings, about.count_suggested_bindings as usize) };
    code(with(|state| {
        is(instance, state.instance)?;
        require(!state.attached, Result::ERROR_ACTIONSETS_ALREADY_ATTACHED)?;
        let profile = path_text(state, about.interaction_profile)?;
        require([PROFILE, OTHER_PROFILE].contains(&profile.as_str()), Result::ERROR_PATH_UNSUPPORTED)?;
        let mut bindings = Vec::new();
        for binding in suggested {
            let (action, path) = (binding.action.into_raw(), path_text(state, binding.binding)?);
            let kind = *state.actions.get(&action).ok_or(Result::ERROR_HANDLE_INVALID)?;
            let is_pose = path.ends_with("/pose");
            let is_known = is_pose || BUTTONS.contains(&path.as_str()) || profile == OTHER_PROFILE;
            require(is_known, Result::ERROR_PATH_UNSUPPORTED)?;
            let expected = if is_pose { xr::ActionType::POSE_INPUT } else { xr::ActionType::BOOLEAN_INPUT };
            require(kind == expected, Result::ERROR_PATH_UNSUPPORTED)?;
            bindings.push((action, path));
        }
        if profile == PROFILE {
            state.bindings = bindings;
        }
        Ok(())
    }))
}

pub unsafe extern "system" fn attach_action_sets(
    session: xr::Session,
    _about: *const xr::SessionActionSetsAttachInfo,
) -> Result {
    code(with(|state| {
        lives(state, session)?;
        require(!state.attached, Result::ERROR_ACTIONSETS_ALREADY_ATTACHED)?;
        state.attached = true;
        Ok(())
    }))
}

pub unsafe extern "system" fn sync_actions(session: xr::Session, _about: *const xr::ActionsSyncInfo) -> Result {
    with(|state| {
        let answer = lives(state, session).and_then(|()| require(state.attached, Result::ERROR_ACTIONSET_NOT_ATTACHED));
        if let Err(why) = answer {
            return why;
        }
        state.held = if state.running { held() } else { 0 };
        if state.running { Result::SUCCESS } else { Result::SESSION_NOT_FOCUSED }
    })
}

pub unsafe extern "system" fn boolean_state(
    session: xr::Session,
    about: *const xr::ActionStateGetInfo,
    out: *mut xr::ActionStateBoolean,
) -> Result {
    let (about, out) = unsafe { (&*about, &mut *out) };
    code(with(|state| {
        lives(state, session)?;
        let action = about.action.into_raw();
        let kind = *state.actions.get(&action).ok_or(Result::ERROR_HANDLE_INVALID)?;
        require(kind == xr::ActionType::BOOLEAN_INPUT, Result::ERROR_ACTION_TYPE_MISMATCH)?;
        let hand = path_text(state, about.subaction_path)?;
        let bit = state.input(action, &hand).and_then(|path| BUTTONS.iter().position(|known| *known == path));
        out.is_active = bit.is_some().into();
        out.current_state = bit.is_some_and(|bit| state.held >> bit & 1 == 1).into();
        out.changed_since_last_sync = xr::FALSE;
        out.last_change_time = xr::Time::from_nanos(1);
        Ok(())
    }))
}

/// Time of OpenXR: ns since 1970, at the call; the given time is one of a moment ago.
pub unsafe extern "system" fn time_of(
    instance: xr::Instance,
    _time: *const libc::timespec,
    out: *mut xr::Time,
) -> Result {
    code(with(|state| {
        is(instance, state.instance)?;
        unsafe { out.write(xr::Time::from_nanos(now_ns())) };
        Ok(())
    }))
}

fn now_ns() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(1, |time| time.as_nanos() as i64)
}

fn is_identity(pose: &xr::Posef) -> bool {
    *pose == motion::pose([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
}
