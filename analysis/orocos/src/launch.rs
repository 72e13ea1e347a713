//! The launch file of ROS that starts the deployer with the script of a deployment: `roslaunch exploration D.launch`.

use crate::deployment::RunnableDeployment;
use crate::escape::xml;
use crate::generated_file::generated_from;
use crate::origin::comment_lines;
use crate::template::filled;

/// Names contain no substitutions of roslaunch: the only `$(find …)` and `$(arg …)` are those of the template.
pub(crate) fn launch_file(deployed: &RunnableDeployment) -> String {
    let description: Vec<String> =
        comment_lines(&deployed.description).iter().map(|line| xml(line)).collect();
    let values = [
        ("generated", generated_from(&deployed.package)),
        ("description", description.join("\n     ")),
        ("package", xml(&deployed.package)),
        ("deployment", xml(&deployed.name)),
    ];
    filled(include_str!("../templates/deployment.launch"), &values)
}
