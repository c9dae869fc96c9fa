//! The attributes of the elements that are read: those with a meaning here, and those that are left
//! out with a note. All others are errors, as in MuJoCo.

use super::notes::Ledger;
use crate::parse::suggest::nearest;
use crate::xml::Element;

/// Attributes of one kind of element.
pub(super) struct Attributes {
    used: &'static [&'static str],
    /// Left out, each with the reason.
    dropped: &'static [(&'static [&'static str], &'static str)],
}

const SOFT: &str =
    "soft contacts, limits and constraints (solref, solimp, margin and the like) are left out: here they are hard";
const DATA: &str = "user data and groups of elements that are not drawn are left out";
const LOOKS: &str = "settings of MuJoCo's renderer are left out";
const FLUID: &str = "forces of a fluid or an adhesive are left out";
const SOLVER: &str = "settings of MuJoCo's solver and integrator are left out";
const COMPILER: &str = "settings of MuJoCo's compiler without effect here are left out";
pub(super) const ACTIVATION: &str =
    "delays and activations of actuators are left out: their forces follow the control at once";

pub(super) const COMPILER_ATTRIBUTES: Attributes = Attributes {
    used: &[
        "angle",
        "assetdir",
        "autolimits",
        "balanceinertia",
        "boundinertia",
        "boundmass",
        "coordinate",
        "eulerseq",
        "inertiafromgeom",
        "inertiagrouprange",
        "meshdir",
        "settotalmass",
        "strippath",
    ],
    dropped: &[(
        &[
            "alignfree",
            "conflict",
            "discardvisual",
            "exactmeshinertia",
            "convexhull",
            "fitaabb",
            "fusestatic",
            "passthrough",
            "savecanonical",
            "savecompiled",
            "saveinertial",
            "texturedir",
            "usethread",
        ],
        COMPILER,
    )],
};

pub(super) const OPTION: Attributes = Attributes {
    used: &["gravity", "timestep"],
    dropped: &[
        (&["density", "viscosity", "wind"], FLUID),
        (&["magnetic"], "magnetometers are left out"),
        (&["o_margin", "o_solref", "o_solimp", "o_friction"], SOFT),
        (
            &[
                "actuatorgroupdisable",
                "apirate",
                "ccd_iterations",
                "ccd_tolerance",
                "collision",
                "cone",
                "impratio",
                "integrator",
                "iterations",
                "jacobian",
                "ls_iterations",
                "ls_tolerance",
                "mpr_iterations",
                "mpr_tolerance",
                "noslip_iterations",
                "noslip_tolerance",
                "sdf_initpoints",
                "sdf_iterations",
                "sleep_tolerance",
                "solver",
                "tolerance",
            ],
            SOLVER,
        ),
    ],
};

pub(super) const FLAG: Attributes = Attributes {
    used: &["contact", "gravity", "actuation", "limit", "frictionloss", "equality", "spring", "damper", "passive"],
    dropped: &[(
        &[
            "autoreset",
            "clampctrl",
            "constraint",
            "diagexact",
            "energy",
            "eulerdamp",
            "filterparent",
            "fwdinv",
            "invdiscrete",
            "ipc",
            "island",
            "midphase",
            "multiccd",
            "nativeccd",
            "override",
            "refsafe",
            "sensor",
            "sensornoise",
            "sleep",
            "speculative",
            "warmstart",
        ],
        SOLVER,
    )],
};

pub(super) const BODY: Attributes = Attributes {
    used: &["axisangle", "childclass", "euler", "gravcomp", "mocap", "name", "pos", "quat", "xyaxes", "zaxis"],
    dropped: &[(&["user"], DATA), (&["fuse", "simple", "sleep"], SOLVER)],
};

pub(super) const FRAME: Attributes =
    Attributes { used: &["axisangle", "childclass", "euler", "name", "pos", "quat", "xyaxes", "zaxis"], dropped: &[] };

pub(super) const REPLICATE: Attributes =
    Attributes { used: &["childclass", "count", "euler", "offset", "sep", "quat", "axisangle"], dropped: &[] };

pub(super) const INERTIAL: Attributes = Attributes {
    used: &["axisangle", "diaginertia", "euler", "fullinertia", "mass", "pos", "quat", "xyaxes", "zaxis"],
    dropped: &[],
};

pub(super) const JOINT: Attributes = Attributes {
    used: &[
        "actuatorfrclimited",
        "actuatorfrcrange",
        "armature",
        "axis",
        "class",
        "damping",
        "frictionloss",
        "limited",
        "name",
        "pos",
        "range",
        "ref",
        "springdamper",
        "springref",
        "stiffness",
        "type",
    ],
    dropped: &[
        (&["margin", "solimpfriction", "solimplimit", "solreffriction", "solreflimit"], SOFT),
        (&["user", "group"], DATA),
        (&["actuatorgravcomp"], "`actuatorgravcomp` is left out"),
        (&["springyield"], "`springyield` is left out: springs do not yield"),
    ],
};

pub(super) const FREEJOINT: Attributes =
    Attributes { used: &["name"], dropped: &[(&["group"], DATA), (&["align"], COMPILER)] };

pub(super) const GEOM: Attributes = Attributes {
    used: &[
        "axisangle",
        "class",
        "conaffinity",
        "condim",
        "contype",
        "density",
        "euler",
        "friction",
        "fromto",
        "group",
        "hfield",
        "mass",
        "material",
        "mesh",
        "name",
        "pos",
        "quat",
        "rgba",
        "size",
        "type",
        "xyaxes",
        "zaxis",
    ],
    dropped: &[
        (&["gap", "margin", "solimp", "solmix", "solref"], SOFT),
        (&["adhesion", "fluidcoef", "fluidshape"], FLUID),
        (&["priority"], "the priority of contact parameters is left out: the larger friction of a pair counts"),
        (&["shellinertia"], "`shellinertia` is left out: the mass fills the volume"),
        (&["surfacevel"], "velocities of surfaces are left out"),
        (&["fitscale"], "`fitscale` is left out"),
        (&["castshadow"], LOOKS),
        (&["user"], DATA),
    ],
};

pub(super) const SITE: Attributes = Attributes {
    used: &["axisangle", "class", "euler", "fromto", "name", "pos", "quat", "size", "type", "xyaxes", "zaxis"],
    dropped: &[(&["group", "material", "mesh", "rgba"], "sites are frames and are not drawn"), (&["user"], DATA)],
};

pub(super) const CAMERA: Attributes = Attributes {
    used: &["axisangle", "class", "euler", "fovy", "mode", "name", "pos", "quat", "target", "xyaxes", "zaxis"],
    dropped: &[
        (
            &[
                "focal",
                "focalpixel",
                "ipd",
                "orthographic",
                "output",
                "principal",
                "principalpixel",
                "projection",
                "resolution",
                "sensorsize",
            ],
            LOOKS,
        ),
        (&["user"], DATA),
    ],
};

pub(super) const LIGHT: Attributes = Attributes {
    used: &["active", "castshadow", "class", "diffuse", "dir", "directional", "mode", "name", "pos", "target", "type"],
    dropped: &[(
        &[
            "ambient",
            "attenuation",
            "bulbradius",
            "cutoff",
            "exponent",
            "intensity",
            "range",
            "softness",
            "specular",
            "texture",
        ],
        LOOKS,
    )],
};

pub(super) const MESH: Attributes = Attributes {
    used: &["class", "file", "name", "refpos", "refquat", "scale", "vertex", "face", "content_type", "inertia"],
    dropped: &[
        (&["maxhullvert"], COMPILER),
        (&["material", "normal", "smoothnormal", "texcoord"], LOOKS),
        (&["builtin", "params"], "generated meshes are left out"),
    ],
};

pub(super) const HFIELD: Attributes =
    Attributes { used: &["elevation", "name", "ncol", "nrow", "size", "file", "content_type"], dropped: &[] };

pub(super) const MATERIAL: Attributes = Attributes {
    used: &["class", "name", "rgba", "texture", "metallic", "roughness"],
    dropped: &[(&["emission", "reflectance", "shininess", "specular", "texrepeat", "texuniform"], LOOKS)],
};

/// Attributes of all actuators of joints and tendons that are read.
pub(super) const ACTUATOR: Attributes = Attributes {
    used: &[
        "biasprm",
        "biastype",
        "class",
        "ctrllimited",
        "ctrlrange",
        "damping",
        "armature",
        "dampratio",
        "dyntype",
        "forcelimited",
        "forcerange",
        "gainprm",
        "gaintype",
        "gear",
        "inheritrange",
        "joint",
        "jointinparent",
        "kp",
        "kv",
        "name",
        "tendon",
    ],
    dropped: &[
        (
            &[
                "actdim",
                "actearly",
                "actlimited",
                "actrange",
                "delay",
                "dynprm",
                "interp",
                "nsample",
                "timeconst",
                "ffrange",
                "velrange",
                "input",
            ],
            ACTIVATION,
        ),
        (&["lengthrange"], COMPILER),
        (&["user", "group"], DATA),
        // Transmissions that are left out as a whole.
        (&["body", "site", "refsite", "cranklength", "cranksite", "slidersite"], "its transmission is left out"),
    ],
};

pub(super) const EQUALITY: Attributes = Attributes {
    used: &[
        "active", "anchor", "body1", "body2", "class", "joint1", "joint2", "name", "polycoef", "relpose", "site1",
        "site2",
    ],
    dropped: &[(&["solimp", "solref", "torquescale"], SOFT)],
};

pub(super) const SENSOR: Attributes = Attributes {
    used: &["cutoff", "joint", "name", "objname", "objtype", "refname", "reftype", "site"],
    dropped: &[
        (&["noise"], "`noise` of sensors is left out, as MuJoCo itself adds none"),
        (&["delay", "interp", "interval", "nsample", "history"], "delays of sensors are left out"),
        (&["data", "num"], "data of sensors other than the distance are left out"),
        (&["user"], DATA),
    ],
};

pub(super) const PAIR: Attributes = Attributes {
    used: &["class", "condim", "friction", "geom1", "geom2", "name"],
    dropped: &[(&["gap", "margin", "solimp", "solref", "solreffriction"], SOFT), (&["adhesion"], FLUID)],
};

pub(super) const EXCLUDE: Attributes = Attributes { used: &["body1", "body2", "name"], dropped: &[] };

pub(super) const KEY: Attributes = Attributes {
    used: &["ctrl", "name", "qpos", "qvel"],
    dropped: &[(
        &["act", "mpos", "mquat", "plastic", "time"],
        "time, activations and mocap poses of keyframes are left out",
    )],
};

impl Attributes {
    /// Reports attributes of an element that it does not have, and notes those that are left out.
    pub(super) fn check(&self, element: &Element<'_, '_>, notes: &Ledger) {
        for attribute in element.node().attributes() {
            let name = attribute.name();
            if self.used.contains(&name) {
                continue;
            }
            if let Some((_, why)) = self.dropped.iter().find(|(names, _)| names.contains(&name)) {
                notes.add(element, *why);
                continue;
            }
            let known = self.used.iter().chain(self.dropped.iter().flat_map(|(names, _)| *names)).copied();
            let expected = match nearest(name, known.clone()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("expected {}", crate::parse::suggest::listed(self.used.iter().copied(), "or")),
            };
            element.log.report(
                attribute.range(),
                format!("unknown attribute `{name}` of {}", element.what()),
                expected,
            );
        }
    }
}
