//! The failures of the command: one message and an exit code.

use std::io::IsTerminal;
use tumble::scene::SceneError;
use tumble::scene::cave::CaveError;
use tumble::scene::urdf::UrdfError;

/// The reason for which the command stopped, with its message.
pub enum Failure {
    /// Bad usage or input: exit code 2.
    Input(String),
    /// A failure at run time: exit code 1.
    Run(String),
}

impl Failure {
    /// Bad input.
    pub fn input(why: impl ToString) -> Failure {
        Failure::Input(format!("error: {}\n", why.to_string()))
    }

    /// A failure at run time; `doing` names the activity that failed.
    pub fn run(doing: &str, why: impl ToString) -> Failure {
        Failure::Run(format!("error: {doing}: {}\n", why.to_string()))
    }

    /// A failure at run time names the facets of its process, unless it does so already.
    pub fn of_facets(self, title: &str) -> Failure {
        match self {
            Failure::Run(report) if !report.starts_with("error: facet") => {
                Failure::Run(report.replacen("error: ", &format!("error: {title}: "), 1))
            }
            other => other,
        }
    }

    /// The whole message, with a final line feed.
    pub fn report(&self) -> &str {
        match self {
            Failure::Input(report) | Failure::Run(report) => report,
        }
    }

    /// The exit code.
    pub fn code(&self) -> u8 {
        match self {
            Failure::Input(_) => 2,
            Failure::Run(_) => 1,
        }
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Failure {
        Failure::Input(error.report(std::io::stderr().is_terminal()))
    }
}

impl From<CaveError> for Failure {
    fn from(error: CaveError) -> Failure {
        Failure::Input(error.report(std::io::stderr().is_terminal()))
    }
}

impl From<UrdfError> for Failure {
    fn from(error: UrdfError) -> Failure {
        Failure::Input(error.report(std::io::stderr().is_terminal()))
    }
}
