//! An OpenXR runtime for tests, without a headset and without pictures: a head on a circle and two hands at rest.
//!
//! A program loads it instead of the loader (the library has the functions of one), or the loader loads it as a runtime
//! (`xrNegotiateLoaderRuntimeInterface`, named by a manifest in `XR_RUNTIME_JSON`). It has one instance and one session at
//! a time, refuses calls in a wrong order, and answers functions that a program without pictures does not need with
//! `XR_ERROR_FUNCTION_UNSUPPORTED`.
//!
//! Files in the folder of the environment variable [`FOLDER`] change what it does, from the next call on:
//!
//! | file | effect |
//! |---|---|
//! | `no_headless` | the extension `XR_MND_headless` is missing |
//! | `no_stage` | there is no space `STAGE` |
//! | `no_headset` | the headset is not plugged in |
//! | `hang` | `xrCreateInstance` never returns |
//! | `idle` | a new session is never ready |
//! | `invalid` | all poses are flagged as invalid, and their numbers are nonsense |
//! | `lost` | the session is lost, and no new one is created |
//! | `held` | a number: the held buttons, by the bits of [`BUTTONS`] |

mod calls;
mod motion;
mod state;

pub use motion::{AIM, HEIGHT_M, LEFT_HAND, PERIOD_NS, RADIUS_M, RIGHT_HAND};
pub use state::{BUTTONS, FOLDER};

use calls as call;
use openxr_sys as xr;
use std::ffi::{CStr, c_char};

/// Returns a function by its name.
///
/// # Safety
/// `name` is a text that ends with a zero, and `function` can be written.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn xrGetInstanceProcAddr(
    _instance: xr::Instance,
    name: *const c_char,
    function: *mut Option<xr::pfn::VoidFunction>,
) -> xr::Result {
    // SAFETY: as the caller promises.
    let found = unsafe { CStr::from_ptr(name) }.to_str().ok().and_then(function_of);
    unsafe { function.write(found) };
    if found.is_some() { xr::Result::SUCCESS } else { xr::Result::ERROR_FUNCTION_UNSUPPORTED }
}

/// Names the functions to a loader.
///
/// # Safety
/// Both structures are those of the loader.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn xrNegotiateLoaderRuntimeInterface(
    loader: *const xr::NegotiateLoaderInfo,
    request: *mut xr::NegotiateRuntimeRequest,
) -> xr::Result {
    // SAFETY: as the caller promises.
    let (loader, request) = unsafe { (&*loader, &mut *request) };
    if loader.struct_type != xr::NegotiateLoaderInfo::TYPE || loader.min_interface_version > 1 {
        return xr::Result::ERROR_INITIALIZATION_FAILED;
    }
    request.runtime_interface_version = 1;
    request.runtime_api_version = xr::Version::new(1, 0, 0);
    request.get_instance_proc_addr = Some(xrGetInstanceProcAddr);
    xr::Result::SUCCESS
}

/// As in the specification.
///
/// # Safety
/// As in the specification.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn xrCreateInstance(
    about: *const xr::InstanceCreateInfo,
    instance: *mut xr::Instance,
) -> xr::Result {
    // SAFETY: as the caller promises.
    unsafe { call::create_instance(about, instance) }
}

/// As in the specification.
///
/// # Safety
/// As in the specification.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn xrEnumerateInstanceExtensionProperties(
    layer: *const c_char,
    capacity: u32,
    count: *mut u32,
    properties: *mut xr::ExtensionProperties,
) -> xr::Result {
    // SAFETY: as the caller promises.
    unsafe { call::extensions(layer, capacity, count, properties) }
}

/// The functions by their names, checked against the types of the specification.
macro_rules! functions {
    ($name:expr; $($text:literal: $kind:ident = $function:path,)*) => {
        match $name {
            $($text => {
                let function: xr::pfn::$kind = $function;
                // SAFETY: a pointer to a function, which the caller gives its type again.
                Some(unsafe { std::mem::transmute::<xr::pfn::$kind, xr::pfn::VoidFunction>(function) })
            })*
            _ => None,
        }
    };
}

fn function_of(name: &str) -> Option<xr::pfn::VoidFunction> {
    let known = functions! { name;
        "xrGetInstanceProcAddr": GetInstanceProcAddr = xrGetInstanceProcAddr,
        "xrEnumerateInstanceExtensionProperties": EnumerateInstanceExtensionProperties = xrEnumerateInstanceExtensionProperties,
        "xrCreateInstance": CreateInstance = xrCreateInstance,
        "xrDestroyInstance": DestroyInstance = call::destroy_instance,
        "xrGetInstanceProperties": GetInstanceProperties = call::instance_properties,
        "xrPollEvent": PollEvent = call::poll_event,
        "xrStringToPath": StringToPath = call::string_to_path,
        "xrGetSystem": GetSystem = call::get_system,
        "xrCreateSession": CreateSession = call::create_session,
        "xrDestroySession": DestroySession = call::destroy_session,
        "xrBeginSession": BeginSession = call::begin_session,
        "xrEndSession": EndSession = call::end_session,
        "xrEnumerateReferenceSpaces": EnumerateReferenceSpaces = call::reference_spaces,
        "xrCreateReferenceSpace": CreateReferenceSpace = call::create_reference_space,
        "xrCreateActionSpace": CreateActionSpace = call::create_action_space,
        "xrLocateSpace": LocateSpace = call::locate_space,
        "xrDestroySpace": DestroySpace = call::destroy_space,
        "xrCreateActionSet": CreateActionSet = call::create_action_set,
        "xrDestroyActionSet": DestroyActionSet = call::destroy_action_set,
        "xrCreateAction": CreateAction = call::create_action,
        "xrDestroyAction": DestroyAction = call::destroy_action,
        "xrSuggestInteractionProfileBindings": SuggestInteractionProfileBindings = call::suggest_bindings,
        "xrAttachSessionActionSets": AttachSessionActionSets = call::attach_action_sets,
        "xrSyncActions": SyncActions = call::sync_actions,
        "xrGetActionStateBoolean": GetActionStateBoolean = call::boolean_state,
        "xrConvertTimespecTimeToTimeKHR": ConvertTimespecTimeToTimeKHR = call::time_of,
    };
    // SAFETY: a caller gives its arguments in vain; the result is that of all functions
    let unsupported = || unsafe {
        std::mem::transmute::<unsafe extern "system" fn() -> xr::Result, xr::pfn::VoidFunction>(call::unsupported)
    };
    known.or_else(|| NOT_NEEDED.contains(&name).then(unsupported))
}

/// The rest of OpenXR 1.0, and of `XR_KHR_convert_timespec_time`.
const NOT_NEEDED: [&str; 31] = [
    "xrConvertTimeToTimespecTimeKHR",
    "xrEnumerateApiLayerProperties",
    "xrResultToString",
    "xrStructureTypeToString",
    "xrGetSystemProperties",
    "xrEnumerateSwapchainFormats",
    "xrCreateSwapchain",
    "xrDestroySwapchain",
    "xrEnumerateSwapchainImages",
    "xrAcquireSwapchainImage",
    "xrWaitSwapchainImage",
    "xrReleaseSwapchainImage",
    "xrRequestExitSession",
    "xrEnumerateViewConfigurations",
    "xrEnumerateEnvironmentBlendModes",
    "xrGetViewConfigurationProperties",
    "xrEnumerateViewConfigurationViews",
    "xrBeginFrame",
    "xrLocateViews",
    "xrEndFrame",
    "xrWaitFrame",
    "xrApplyHapticFeedback",
    "xrStopHapticFeedback",
    "xrPathToString",
    "xrGetReferenceSpaceBoundsRect",
    "xrGetActionStateFloat",
    "xrGetActionStateVector2f",
    "xrGetActionStatePose",
    "xrGetCurrentInteractionProfile",
    "xrEnumerateBoundSourcesForAction",
    "xrGetInputSourceLocalizedName",
];
