//! SDF files (of Gazebo): poses, joints, masses, notes and errors.

use nalgebra::DMatrix;
use tumble_core::articulated::{InverseDynamics, Kinematics, MassMatrix};
use tumble_core::collide::Vec3;
use tumble_core::{ArticulatedBody, Joint, RigidBody, World};
use tumble_scene::sdformat::{SdformatError, parse};
use tumble_scene::urdf::UrdfOptions;
use tumble_scene::{SceneFile, urdf};

fn read(text: &str) -> Result<SceneFile, SdformatError> {
    parse(text, "model.sdf", &UrdfOptions::default())
}

/// Reads a model with this content.
fn model(content: &str) -> SceneFile {
    let text = format!("<sdf version=\"1.9\">\n<model name=\"m\">\n{content}\n</model>\n</sdf>\n");
    read(&text).unwrap_or_else(|error| panic!("{error}"))
}

fn errors(content: &str) -> Vec<String> {
    let text = format!("<sdf version=\"1.9\">\n<model name=\"m\">\n{content}\n</model>\n</sdf>\n");
    match read(&text) {
        Ok(_) => panic!("it is read"),
        Err(error) => error.to_string().lines().map(str::to_owned).collect(),
    }
}

fn inertial(mass: f64, moments: [f64; 3]) -> String {
    let [x, y, z] = moments;
    format!("<inertial><mass>{mass}</mass><inertia><ixx>{x}</ixx><iyy>{y}</iyy><izz>{z}</izz></inertia></inertial>")
}

fn body<'w>(world: &'w World, name: &str) -> &'w ArticulatedBody {
    world.get::<ArticulatedBody>(world.find(name).unwrap()).unwrap()
}

/// Mass matrix and bias forces at a state.
fn dynamics(body: &ArticulatedBody, q: &[f64], v: &[f64], gravity: Vec3) -> (DMatrix<f64>, Vec<f64>) {
    let model = body.model();
    let mut kin = Kinematics::new(model);
    kin.refresh(model, q, v);
    let n = model.dof();
    let (mut mass, mut bias) = (vec![0.0; n * n], vec![0.0; n]);
    MassMatrix::new(model).write(model, &kin, &mut mass);
    InverseDynamics::new(model).bias(model, &kin, &gravity, &[], &mut bias);
    (DMatrix::from_vec(n, n, mass), bias)
}

const G: Vec3 = Vec3::new(0.0, 0.0, -9.81);

/// A rod about a hinge `d` above its center of mass: `M = I + m·d²`, bias `m·g·d·sin q`. Joint pose, link pose, inertial pose and axis are
/// each turned or moved, with equal results.
#[test]
fn a_pendulum_has_the_constants_of_its_closed_form_wherever_its_frames_are() {
    let (m, i, d) = (2.0, 0.3, 0.4);
    let own = inertial(m, [i; 3]);
    let joint = |pose: &str, axis: &str| {
        format!(
            "<joint name=\"j\" type=\"revolute\"><pose>{pose}</pose><parent>world</parent><child>rod</child><axis><xyz>{axis}</xyz></axis></joint>"
        )
    };
    let in_link = |pose: &str| own.replace("<mass>", &format!("<pose>{pose}</pose><mass>"));
    let cases = [
        // the joint is above the link's origin, which is the center of mass
        format!("<link name=\"rod\"><pose>0 0 1 0 0 0</pose>{own}</link>{}", joint("0 0 0.4 0 0 0", "0 1 0")),
        // the link's origin is the joint
        format!("<link name=\"rod\">{}</link>{}", in_link("0 0 -0.4 0 0 0"), joint("0 0 0 0 0 0", "0 1 0")),
        // the link is turned about x by 90 degrees: its y is the world's z, and the axis is its -z
        format!(
            "<link name=\"rod\"><pose degrees=\"true\">0 0 0 90 0 0</pose>{}</link>{}",
            in_link("0 -0.4 0 0 0 0"),
            joint("", "0 0 -1")
        ),
        // the joint's frame is turned about z by 90 degrees: its x is the link's y
        format!("<link name=\"rod\">{own}</link>{}", joint("0 0 0.4 0 0 1.5707963267948966", "1 0 0")),
        // a quaternion, and an axis in the frame of the model
        format!(
            "<link name=\"rod\"><pose rotation_format=\"quat_xyzw\">0 0 0 0.5 0.5 0.5 0.5</pose>{own}</link>{}",
            joint("0 0.4 0 0 0 0", "0 1 0").replace("<xyz>", "<xyz expressed_in=\"__model__\">")
        ),
    ];
    for (n, content) in cases.iter().enumerate() {
        let scene = model(content);
        let (world, _) = scene.build().unwrap();
        let rod = body(&world, "m");
        for q in [0.0, 0.3, -1.2] {
            let (mass, bias) = dynamics(rod, &[q], &[0.7], G);
            assert!((mass[(0, 0)] - (i + m * d * d)).abs() < 1e-12, "case {n}: {mass}");
            assert!((bias[0].abs() - (m * 9.81 * d * f64::sin(q)).abs()).abs() < 1e-12, "case {n}, {q}: {bias:?}");
        }
    }
}

/// The same arm as URDF and as SDF: in one file poses are in the parent's frame, in the other in the model's.
#[test]
fn a_model_is_the_robot_of_its_urdf() {
    let part = "<mass value=\"1.5\"/><origin xyz=\"0.1 0 0.2\" rpy=\"0.1 0.2 0.3\"/><inertia ixx=\"0.02\" iyy=\"0.03\" izz=\"0.04\" ixy=\"0.001\" ixz=\"0\" iyz=\"-0.002\"/>";
    let robot = format!(
        "<robot name=\"arm\"><link name=\"base\"/><link name=\"a\"><inertial>{part}</inertial></link><link name=\"b\"><inertial>{part}</inertial></link><link name=\"c\"><inertial>{part}</inertial></link>
        <joint name=\"j1\" type=\"revolute\"><parent link=\"base\"/><child link=\"a\"/><origin xyz=\"0 0.1 0.5\" rpy=\"0.3 0 0.1\"/><axis xyz=\"0 0.6 0.8\"/><limit lower=\"-1\" upper=\"2\" effort=\"5\" velocity=\"1\"/><dynamics damping=\"0.1\" friction=\"0.2\"/></joint>
        <joint name=\"j2\" type=\"prismatic\"><parent link=\"a\"/><child link=\"b\"/><origin xyz=\"0.2 0 0.1\" rpy=\"0 0.5 0\"/><axis xyz=\"1 0 0\"/><limit lower=\"0\" upper=\"0.3\" effort=\"5\" velocity=\"1\"/></joint>
        <joint name=\"j3\" type=\"continuous\"><parent link=\"b\"/><child link=\"c\"/><origin xyz=\"0 0 0.3\" rpy=\"0 0 1\"/><axis xyz=\"0 0 1\"/></joint></robot>"
    );
    let theirs = urdf::parse_model(&robot, "arm.urdf", &UrdfOptions::default()).unwrap();
    let own = "<inertial><pose>0.1 0 0.2 0.1 0.2 0.3</pose><mass>1.5</mass><inertia><ixx>0.02</ixx><iyy>0.03</iyy><izz>0.04</izz><ixy>0.001</ixy><iyz>-0.002</iyz></inertia></inertial>";
    let scene = model(&format!(
        "<link name=\"a\"><pose>0 0.1 0.5 0.3 0 0.1</pose>{own}</link>
        <link name=\"b\"><pose relative_to=\"a\">0.2 0 0.1 0 0.5 0</pose>{own}</link>
        <frame name=\"tip\" attached_to=\"b\"><pose>0 0 0.3 0 0 0</pose></frame>
        <link name=\"c\"><pose relative_to=\"tip\">0 0 0 0 0 1</pose>{own}</link>
        <joint name=\"j1\" type=\"revolute\"><parent>world</parent><child>a</child><axis><xyz>0 0.6 0.8</xyz><limit><lower>-1</lower><upper>2</upper><effort>5</effort></limit><dynamics><damping>0.1</damping><friction>0.2</friction></dynamics></axis></joint>
        <joint name=\"j2\" type=\"prismatic\"><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz><limit><lower>0</lower><upper>0.3</upper><effort>5</effort></limit></axis></joint>
        <joint name=\"j3\" type=\"continuous\"><parent>b</parent><child>c</child><axis><xyz>0 0 1</xyz></axis></joint>"
    ));
    assert_eq!(scene.notes, Vec::<String>::new());
    let (world, _) = scene.build().unwrap();
    let ours = body(&world, "m");
    let (q, v) = ([0.4, 0.2, -0.7], [1.0, -0.3, 2.0]);
    let robot = ArticulatedBody::new("arm", theirs.model);
    let ((mass, bias), (other, forces)) = (dynamics(ours, &q, &v, G), dynamics(&robot, &q, &v, G));
    assert!((&mass - &other).amax() < 1e-12, "{mass}{other}");
    assert!(bias.iter().zip(&forces).all(|(a, b)| (a - b).abs() < 1e-12), "{bias:?} {forces:?}");
    assert_eq!(ours.dofs(), &theirs.dofs[..]);
}

/// A universal joint has two axes through its point; a ball three. A point mass at distance `d` meets `m·d²` about each axis across it.
#[test]
fn universal_and_ball_joints_are_their_axes() {
    let mass = "<inertial><pose>0 0 -0.5 0 0 0</pose><mass>2</mass><inertia><ixx>0</ixx><iyy>0</iyy><izz>0</izz></inertia></inertial>";
    let universal = model(&format!(
        "<link name=\"l\">{mass}</link><joint name=\"u\" type=\"universal\"><parent>world</parent><child>l</child><axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2></joint>"
    ));
    assert_eq!(universal.articulated[0].links[0].joint.name, "u/axis");
    let (world, _) = universal.build().unwrap();
    let (m, _) = dynamics(body(&world, "m"), &[0.0, 0.3], &[0.0; 2], G);
    // the first axis meets m·(d·cos q₂)², the second m·d²
    let d = 0.5;
    assert!(
        (m[(0, 0)] - 2.0 * (d * f64::cos(0.3)).powi(2)).abs() < 1e-12 && (m[(1, 1)] - 2.0 * d * d).abs() < 1e-12,
        "{m}"
    );
    let ball = model(&format!(
        "<link name=\"l\"><pose>1 0 0 0 0 0</pose>{mass}</link><joint name=\"b\" type=\"ball\"><pose>0 0 0.25 0 0 0</pose><parent>world</parent><child>l</child></joint>"
    ));
    let links = &ball.articulated[0].links;
    assert_eq!((links[0].name.as_str(), links[1].name.as_str()), ("l/b", "l"));
    assert_eq!(links[0].joint.kind, Joint::Spherical);
    let (world, _) = ball.build().unwrap();
    let (m, _) = dynamics(body(&world, "m"), &[0.0, 0.0, 0.0, 1.0], &[0.0; 3], G);
    let expected =
        DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![2.0 * 0.75 * 0.75, 2.0 * 0.75 * 0.75, 0.0]));
    assert!((&m - expected).amax() < 1e-12, "{m}");
}

/// The default of `mu` in the specification is 1; options that state a friction replace it.
#[test]
fn a_collision_without_mu_has_a_friction_of_one() {
    let text = |surface: &str| {
        let collision = "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry>";
        format!(
            "<sdf version='1.8'><model name='m'><link name='l'>{collision}{surface}</collision></link></model></sdf>"
        )
    };
    let friction = |surface: &str, own: Option<f64>| {
        let mut options = UrdfOptions::default();
        if let Some(own) = own {
            options.surface.contact.friction = own;
            options.friction_given = true;
        }
        let scene = parse(&text(surface), "m.sdf", &options).unwrap_or_else(|error| panic!("{error}"));
        assert!(!scene.notes.iter().any(|note| note.contains("mu")), "{:?}", scene.notes);
        scene.articulated[0].links[0].shapes[0].surface.contact.friction
    };
    let given = "<surface><friction><ode><mu>0.3</mu></ode></friction></surface>";
    let bounce = "<surface><bounce><restitution_coefficient>0.2</restitution_coefficient></bounce></surface>";
    assert_eq!([friction("", None), friction(bounce, None), friction("<surface/>", None)], [1.0; 3]);
    assert_eq!([friction(given, None), friction(given, Some(0.7))], [0.3; 2]);
    assert_eq!([friction("", Some(0.7)), friction("", Some(0.5))], [0.7, 0.5]);
}

/// A box of a world falls on the static plane and comes to rest half its size above it.
#[test]
fn a_world_has_its_gravity_models_and_floor() {
    let text = "<sdf version='1.8'><world name='w'>
      <gravity>0 0 -1.62</gravity><physics type='ode'><max_step_size>0.002</max_step_size></physics>
      <light type='directional' name='sun'><direction>0 0 -2</direction><diffuse>1 0.5 0.5 1</diffuse></light>
      <model name='ground'><static>true</static><link name='l'><collision name='c'><geometry><plane><normal>0 0 1</normal></plane></geometry>
        <surface><friction><ode><mu>0.7</mu></ode></friction></surface></collision></link></model>
      <model name='box'><pose>0 0 0.3 0 0 0</pose><link name='b'><inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></inertial>
        <collision name='c'><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision></link></model>
      <model name='pair'><pose>2 0 1 0 0 0</pose><link name='x'/><link name='y'><pose>0 1 0 0 0 0</pose></link></model>
    </world></sdf>";
    let scene = read(text).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.world.gravity_m_per_s2, scene.world.dt_s), ([0.0, 0.0, -1.62], 0.002));
    assert_eq!(scene.lights[0].color, [1.0, 0.5, 0.5]);
    let names: Vec<&str> = scene.articulated.iter().map(|spec| spec.name.as_str()).collect();
    assert_eq!(names, ["box", "pair/x", "pair/y"]);
    let (mut world, _) = scene.build().unwrap();
    let plane = world.get::<RigidBody>(world.find("ground/l/plane0").unwrap()).unwrap();
    assert_eq!(plane.material.friction, 0.7);
    let id = world.find("box").unwrap();
    while world.time() < 0.2 {
        world.step().unwrap();
    }
    // free fall at first: z = 0.3 − g·t²/2
    let fallen = 0.3 - 0.5 * 1.62 * world.time().powi(2);
    assert!((world.pose(id, 0).unwrap().translation.z - fallen).abs() < 1e-3);
    while world.time() < 3.0 {
        world.step().unwrap();
    }
    let pose = world.pose(id, 0).unwrap();
    assert!((pose.translation.z - 0.1).abs() < 1e-4, "{pose}");
    let other = world.pose(world.find("pair/y").unwrap(), 0).unwrap();
    assert!((other.translation.x - 2.0).abs() < 1e-9 && (other.translation.y - 1.0).abs() < 1e-9, "{other}");
}

#[test]
fn limits_springs_and_couplings_are_those_of_the_file() {
    let own = inertial(1.0, [0.1; 3]);
    let scene = model(&format!(
        "<link name=\"a\">{own}</link><link name=\"b\">{own}</link>
        <joint name=\"j\" type=\"revolute\"><parent>world</parent><child>a</child><axis><xyz>0 0 1</xyz><limit><lower>-1e16</lower><upper>1e16</upper><effort>-1</effort></limit>
        <dynamics><spring_stiffness>3</spring_stiffness><spring_reference>0.5</spring_reference></dynamics></axis></joint>
        <joint name=\"k\" type=\"revolute\"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz><mimic joint=\"j\" axis=\"axis\"><multiplier>2</multiplier><offset>0.3</offset><reference>0.1</reference></mimic></axis></joint>"
    ));
    let links = &scene.articulated[0].links;
    let spring = links[0].joint.dof.spring.as_ref().unwrap();
    assert_eq!(
        (spring.stiffness, spring.rest, links[0].joint.dof.limits, links[0].joint.dof.effort),
        (3.0, 0.5, None, f64::INFINITY)
    );
    let mimic = links[1].joint.mimic.unwrap();
    assert_eq!((mimic.link, mimic.multiplier), (0, 2.0));
    assert!((mimic.offset - 0.1).abs() < 1e-15);
}

#[test]
fn what_is_left_out_is_noted_with_file_line_and_element() {
    let scene = model(
        "<plugin name=\"p\" filename=\"p.so\"/>
<link name=\"l\">
<sensor name=\"s\" type=\"imu\"/>
<gravity>0</gravity>
<collision name=\"c\"><geometry><polyline/></geometry></collision>
<visual name=\"v\"><geometry><mesh><uri>model://nowhere/v.dae</uri></mesh></geometry><material><script/></material></visual>
</link>",
    );
    let notes = scene.notes.join("\n");
    for expected in [
        "model.sdf:3: plugin \"p\": <plugin> is left out",
        "model.sdf:4: link \"l\": without <inertial> it has 1 kg",
        "model.sdf:5: sensor \"s\": <sensor> is left out",
        "model.sdf:6: the gravity of link \"l\": <gravity> is left out",
        "<polyline> shapes are left out",
        "model.sdf:8: visual mesh model://nowhere/v.dae: left out: there is no such file",
    ] {
        assert!(notes.contains(expected), "{expected} is missing in\n{notes}");
    }
}

#[test]
fn wrong_files_are_errors_with_line_value_and_what_is_right() {
    let rod = inertial(1.0, [0.1; 3]);
    let cases: [(&str, &str); 16] = [
        ("", "model.sdf:2:1: model \"m\" has 0 links; expected 1 to"),
        ("<link name=\"a\"/><link name=\"a\"/>", "has the name of link \"a\" at model.sdf:3; expected a unique name"),
        (
            "<include><uri>model://x</uri></include><link name=\"a\"/>",
            "is nested in a model; expected a model without nested models and includes",
        ),
        ("<model name=\"n\"/><link name=\"a\"/>", "is nested in a model"),
        ("<link name=\"a\"><pose relative_to=\"b\">0 0 0 0 0 0</pose></link>", "is relative to \"b\"; "),
        (
            "<link name=\"a\"><pose relative_to=\"a\">0 0 0 0 0 0</pose></link>",
            "has a pose relative to itself; expected frames without loops",
        ),
        ("<link name=\"a\"><pose>0 0 0</pose></link>", "the pose of link \"a\" is \"0 0 0\"; expected 6 numbers"),
        ("<link name=\"a\"><pose>0 0 x 0 0 0</pose></link>", "is \"0 0 x 0 0 0\"; expected 6 numbers"),
        (
            "<link name=\"a\"/><joint name=\"j\" type=\"screw\"><parent>world</parent><child>a</child></joint>",
            "`type` of joint \"j\" is \"screw\"; expected revolute, continuous",
        ),
        (
            "<link name=\"a\"/><joint name=\"j\" type=\"fixed\"><parent>wrld</parent><child>a</child></joint>",
            "joint \"j\" has the parent \"wrld\"; ",
        ),
        (
            "<link name=\"a\"/><joint name=\"j\" type=\"revolute\"><parent>world</parent><child>a</child></joint>",
            "joint \"j\" has no <axis>; expected <axis> with <xyz>",
        ),
        (
            "<link name=\"a\"/><joint name=\"j\" type=\"revolute\"><parent>world</parent><child>a</child><axis><xyz>0 0 0</xyz></axis></joint>",
            "is \"0 0 0\"; expected a direction",
        ),
        (
            "<link name=\"a\"><inertial><mass>-1</mass></inertial></link>",
            "is \"-1\"; expected one number: a number of at least 0",
        ),
        (
            "<link name=\"a\"><collision name=\"c\"><geometry><box><size>1 0 1</size></box></geometry></collision></link>",
            "is \"1 0 1\"; expected 3 numbers",
        ),
        (
            "<link name=\"a\"><collision name=\"c\"><geometry><torus/></geometry></collision></link>",
            "(<torus>) is not a shape; expected <box>",
        ),
        (
            "<link name=\"a\"><inertial><mass>0</mass><inertia><ixx>0</ixx><iyy>0</iyy><izz>0</izz></inertia></inertial></link>",
            "moves no mass",
        ),
    ];
    for (content, expected) in cases {
        let said = errors(content).join("\n");
        assert!(said.contains(expected), "{content}\n{said}\n{expected}");
        assert!(said.starts_with("model.sdf:"), "{said}");
    }
    let two = format!(
        "<link name=\"a\">{rod}</link><link name=\"b\">{rod}</link>{}",
        "<joint name=\"j\" type=\"ball\"><parent>a</parent><child>b</child></joint><joint name=\"k\" type=\"ball\"><parent>b</parent><child>a</child></joint>"
    );
    assert!(errors(&two)[0].contains("is part of a loop of joints; expected trees of links"));
    let said = read("<robot/>").unwrap_err().to_string();
    assert_eq!(said, "model.sdf:1:1: <robot> is the outermost element; expected <sdf>");
    assert!(read("<sdf><world name=\"w\"/></sdf>").unwrap_err().to_string().contains("has no <model>"));
}

#[test]
fn a_scene_names_a_file_as_one_body() {
    let folder = std::env::temp_dir().join(format!("tumble-sdf-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let own = inertial(1.0, [0.1; 3]);
    let file = format!(
        "<sdf version=\"1.9\"><model name=\"arm\"><link name=\"a\">{own}</link><joint name=\"j\" type=\"revolute\"><parent>world</parent><child>a</child><axis><xyz>0 1 0</xyz></axis></joint></model></sdf>"
    );
    std::fs::write(folder.join("arm.sdf"), file).unwrap();
    std::fs::write(folder.join("scene.toml"), "[[articulated]]\nname = \"left\"\nsdformat = \"arm.sdf\"\nposition_m = [0, 1, 0]\ninitial_positions = { j = 0.5 }\n").unwrap();
    let scene = SceneFile::load(folder.join("scene.toml")).unwrap_or_else(|error| panic!("{error}"));
    let (world, _) = scene.build().unwrap();
    assert_eq!(world.state_of(world.find("left").unwrap()).unwrap(), [0.5, 0.0]);
    let alone = SceneFile::load(folder.join("arm.sdf")).unwrap();
    assert_eq!(alone.articulated[0].name, "arm");
    std::fs::write(
        folder.join("scene.toml"),
        "[[articulated]]\nname = \"left\"\nfloating = true\nsdformat = \"arm.sdf\"\n",
    )
    .unwrap();
    let said = SceneFile::load(folder.join("scene.toml")).unwrap_err().to_string();
    assert!(said.contains("no `floating` with `sdformat`"), "{said}");
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A world with one sphere and this light; returns color and place of the light.
fn light(content: &str) -> Result<SceneFile, SdformatError> {
    let ball = "<model name=\"m\"><link name=\"a\"><collision name=\"c\"><geometry><sphere><radius>1</radius></sphere></geometry></collision></link></model>";
    read(&format!("<sdf version=\"1.9\"><world name=\"w\">{ball}{content}</world></sdf>"))
}

#[test]
fn colors_of_lights_have_three_or_four_numbers() {
    for (diffuse, color) in [("1 0.5 0.25", [1.0, 0.5, 0.25]), ("0 0.5 2 0.1", [0.0, 0.5, 1.0])] {
        let scene = light(&format!("<light type=\"point\" name=\"l\"><diffuse>{diffuse}</diffuse></light>")).unwrap();
        assert_eq!(scene.lights[0].color, color);
    }
    let plain = light("<light type=\"point\" name=\"l\"></light>").unwrap();
    assert_eq!(plain.lights[0].color, [1.0; 3]);
    for (content, why) in [
        ("<diffuse>1 1</diffuse>", "the diffuse of light \"l\" is \"1 1\""),
        ("<pose relative_to=\"m\">0 0 1 0 0 0</pose>", "`relative_to` of the pose of light \"l\" is \"m\""),
    ] {
        let error = light(&format!("<light type=\"point\" name=\"l\">{content}</light>")).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
}

/// Gravity of 9.8 m/s² is the default of the format, and not that of this engine.
#[test]
fn a_world_without_gravity_has_that_of_the_format() {
    assert_eq!(light("").unwrap().world.gravity_m_per_s2, [0.0, 0.0, -9.8]);
    assert_eq!(light("<gravity>0 0 -1.62</gravity>").unwrap().world.gravity_m_per_s2, [0.0, 0.0, -1.62]);
}

/// Joints may name frames, other joints and the model instead of links; poses are then in these frames.
#[test]
fn joints_join_the_links_that_carry_their_frames() {
    let links = format!(
        "<link name=\"a\">{0}</link><link name=\"b\"><pose>0 0 10 0 0 0</pose>{0}</link><frame name=\"f\" attached_to=\"b\"><pose>1 0 0 0 0 0</pose></frame><frame name=\"g\" attached_to=\"f\"><pose>0 0 0 0 0 1.5707963267948966</pose></frame>",
        inertial(1.0, [0.1; 3])
    );
    let joint = |parent: &str, child: &str| {
        format!(
            "<joint name=\"j\" type=\"revolute\"><pose>0 2 0 0 0 0</pose><parent>{parent}</parent><child>{child}</child><axis><xyz>1 0 0</xyz></axis></joint>"
        )
    };
    // the point of the hinge in the model, and its axis
    for (child, point, axis) in [
        ("b", [0.0, 2.0, 10.0], [1.0, 0.0, 0.0]),
        ("f", [1.0, 2.0, 10.0], [1.0, 0.0, 0.0]),
        ("g", [-1.0, 0.0, 10.0], [0.0, 1.0, 0.0]),
    ] {
        for parent in ["a", "__model__"] {
            let scene = model(&format!("{links}{}", joint(parent, child)));
            let (world, _) = scene.build().unwrap();
            let body = body(&world, "m");
            let number = body.model().links().iter().position(|link| link.joint.dof() == 1).unwrap();
            let link = &body.model().links()[number];
            let Joint::Revolute { axis: turns } = link.joint else { panic!("{:?}", link.joint) };
            assert_eq!(link.parent, Some(0));
            assert!(
                (link.placement.translation.vector - Vec3::from(point)).norm() < 1e-12,
                "{child}: {}",
                link.placement
            );
            assert!((link.placement.rotation * turns - Vec3::from(axis)).norm() < 1e-12, "{child}");
        }
    }
    let error = errors(&format!("{links}{}", joint("a", "nobody")));
    assert!(error[0].contains("joint \"j\"") && error[0].contains("\"nobody\""), "{error:?}");
}

/// Axes of versions before 1.5 are in the frame of the model, those of later ones in that of the joint.
#[test]
fn axes_are_in_the_frame_of_their_version() {
    for (version, axis) in [("1.4", Vec3::x()), ("1.5", Vec3::y()), ("1.9", Vec3::y())] {
        let text = format!(
            "<sdf version=\"{version}\"><model name=\"m\"><link name=\"a\"><pose>0 0 0 0 0 1.5707963267948966</pose>{}</link><joint name=\"j\" type=\"revolute\"><parent>world</parent><child>a</child><axis><xyz>1 0 0</xyz></axis></joint></model></sdf>",
            inertial(1.0, [0.1; 3])
        );
        let (world, _) = read(&text).unwrap().build().unwrap();
        let link = &body(&world, "m").model().links()[0];
        let Joint::Revolute { axis: turns } = link.joint else { panic!("{:?}", link.joint) };
        assert!((link.placement.rotation * turns - axis).norm() < 1e-12, "{version}: {turns}");
    }
}

/// A cone of SDF has its origin halfway up; its center of mass is a quarter of its height above the base. A mass beside `auto` is
/// the mass: `I_zz = 3/10·m·r²`.
#[test]
fn cones_stand_on_half_their_length() {
    let scene = model(
        "<link name=\"a\"><inertial auto=\"true\"><mass>5</mass></inertial><collision name=\"c\"><geometry><cone><radius>0.5</radius><length>2</length></cone></geometry></collision></link>",
    );
    let (world, _) = scene.build().unwrap();
    let mass = body(&world, "m").model().links()[0].mass;
    assert!((mass.mass - 5.0).abs() < 1e-12 && (mass.center - Vec3::new(0.0, 0.0, -0.5)).norm() < 1e-12, "{mass:?}");
    assert!((mass.inertia.m33 - 0.3 * 5.0 * 0.25).abs() < 1e-12, "{mass:?}");
}

/// Hyphens in comments and prefixes without a declaration are no errors; messages name lines of the file.
#[test]
fn texts_that_strict_xml_refuses_are_read() {
    let text = |link: &str| {
        format!(
            "<sdf version=\"1.9\">\n<!-- a -- b --- é -->\n<model name=\"m\" gz:x=\"1\">\n<gz:word>1</gz:word>\n<link name=\"a\">{link}</link>\n</model></sdf>"
        )
    };
    let scene = read(&text(&inertial(1.0, [1.0; 3]))).unwrap();
    let note = scene.notes.join("\n");
    assert!(note.contains("model.sdf:4") && note.contains("gz.word"), "{note}");
    let error = read(&text("<inertial><mass>-1</mass></inertial>")).unwrap_err().to_string();
    assert!(error.contains("model.sdf:5:"), "{error}");
}
