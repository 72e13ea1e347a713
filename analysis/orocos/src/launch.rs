//! The launch file of ROS that starts the deployer with the script of a deployment: `roslaunch exploration D.launch`.

use crate::deployment::Deployed;
use crate::escape::xml;
use crate::generated_file::generated_from;
use crate::origin::comment_lines;

pub(crate) fn launch_file(deployed: &Deployed) -> String {
    let package = &deployed.package;
    // Names contain no substitutions of roslaunch: the only `$(find …)` and `$(arg …)` are those below.
    let script = xml(&format!("-s $(find {package})/scripts/{}.lua", deployed.name));
    let description: Vec<String> =
        comment_lines(&deployed.description).iter().map(|line| xml(line)).collect();
    let description = description.join("\n     ");
    let generated = generated_from(package);
    format!(
        r#"<?xml version="1.0"?>
<!-- {generated} -->
<!-- {description} -->
<launch>
  <arg name="namespace" default="/" doc="The namespace of the topics"/>
  <arg name="log_level" default="info" doc="The log level of Orocos: error, warning, info or debug"/>
  <arg name="start" default="true" doc="false: components are configured, and not started"/>
  <arg name="values" default="" doc="A folder with property values: INSTANCE.cpf"/>
  <arg name="allow_non_realtime" default="false"
       doc="true: starts even if threads are not scheduled as analysed"/>

  <group ns="$(arg namespace)">
    <env name="MAUVE_START" value="$(arg start)"/>
    <env name="MAUVE_VALUES" value="$(arg values)"/>
    <env name="MAUVE_ALLOW_NON_REALTIME" value="$(arg allow_non_realtime)"/>
    <include file="$(find rtt_ros)/launch/deployer.launch">
      <arg name="LOG_LEVEL" value="$(arg log_level)"/>
      <arg name="DEPLOYER_ARGS" value="{script}"/>
    </include>
  </group>
</launch>
"#
    )
}
