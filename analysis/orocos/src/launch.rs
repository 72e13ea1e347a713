//! The launch file of ROS that starts the deployer with the script of a deployment: `roslaunch exploration D.launch`.

use crate::deployment::{Deployed, comment_lines};
use crate::escape::xml;

/// The launch file of a deployment that stands in `package`.
pub(crate) fn launch_file(deployed: &Deployed, package: &str) -> String {
    // Names have nothing that roslaunch would substitute: the only `$(find …)` are those here.
    let script = xml(&format!("-s $(find {package})/scripts/{}.ops", deployed.name));
    let description: Vec<String> =
        comment_lines(&deployed.description).iter().map(|line| xml(line)).collect();
    let description = description.join("\n     ");
    format!(
        r#"<?xml version="1.0"?>
<!-- {description} -->
<!-- Generated from the model: what is changed here is lost. -->
<launch>
  <include file="$(find rtt_ros)/launch/deployer.launch">
    <arg name="DEPLOYER_ARGS" value="{script}"/>
  </include>
</launch>
"#
    )
}
