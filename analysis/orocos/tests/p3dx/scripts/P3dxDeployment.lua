-- Deployment `exploration.P3dxDeployment` of architecture
-- `exploration.ExplorationP3dxArchitecture` (deployment.mal:4).
-- Generated from the model: what is changed here is lost.

require("rttlib")

local deployer = rtt.getTC()
if deployer:getName() ~= "Deployer" then
  deployer = assert(deployer:getPeer("Deployer"), "there is no Deployer")
end

local function worked(has_worked, what)
  if not has_worked then
    error("Cannot " .. what .. "\nNothing runs.", 0)
  end
end

-- Beside the folder of a package, the deployer takes that for what is installed of it.
local function import(package)
  local is_there = deployer:import(package) or deployer:import("gnulinux/" .. package)
  worked(is_there, "import package " .. package .. ": build it, and source its workspace")
end

local function load(name, class)
  local is_loaded = deployer:loadComponent(name, class)
  worked(is_loaded, "load " .. name .. ", a " .. class .. ": build its package anew")
end

local function task(name)
  return assert(deployer:getPeer(name), "there is no " .. name)
end

local function set(name, property, value)
  local found = assert(task(name):getProperty(property), name .. " has no " .. property)
  found:set(value)
end

-- ROS, and the types of the messages.
-- Topics need rtt_ros_integration. Without them: `[generate] ros_streams = false` in mauve.toml.
import("rtt_ros")
import("rtt_rosnode")
import("rtt_roscomm")
import("rtt_geometry_msgs")
import("rtt_nav_msgs")
import("rtt_sensor_msgs")
import("rtt_std_msgs")

-- The components.
import("drivers")
import("motion")
import("localisation")
import("navigation")
import("exploration")

-- The instances, who provides operations before who requires them: the deployer stops them the
-- other way round.
load("navigation", "navigation::Navigation")
load("control", "motion::Control")
load("guidance", "motion::Guidance")
load("switch", "motion::Switch")
load("teleop", "drivers::Teleop")
load("pose", "localisation::Pose")
load("gmapping", "localisation::Gmapping")
load("p3dx_driver", "drivers::P3dxDriver")
load("hokuyo", "drivers::Hokuyo")
load("exploration", "exploration::Exploration")

-- Values that the model sets, and those that rest on them.
set("control", "max_speed", 0.4)
set("guidance", "body_width", 0.5800000000000001)
set("switch", "body_width", 0.48)
set("teleop", "device", "/dev/input/js0")
set("teleop", "max_speed", 0.5)
set("gmapping", "max_range", 4.0)
set("p3dx_driver", "device", "/dev/ttyS0")
set("hokuyo", "device", "/dev/ttyACM0")
set("hokuyo", "min_angle", -2.09)
set("hokuyo", "max_angle", 2.09)

-- Values of this launch: NAME.cpf in the folder MAUVE_VALUES, for each that has properties.
local values = os.getenv("MAUVE_VALUES") or ""

local function read(name)
  local what = "use the values in " .. name .. ".cpf"
  worked(deployer:loadService(name, "marshalling"), what)
  if values ~= "" then
    local marshalling = task(name):provides("marshalling")
    worked(marshalling:updateProperties(values .. "/" .. name .. ".cpf"), what)
  end
end

read("navigation")
read("control")
read("guidance")
read("switch")
read("teleop")
read("pose")
read("gmapping")
read("p3dx_driver")
read("hokuyo")
read("exploration")

-- The connections: from an output to an input, which keeps the last value or so many.
local function connect(from, to, size, what)
  local policy = rtt.Variable("ConnPolicy")
  if size then
    policy.type = rtt.globals.CIRCULAR_BUFFER
    policy.size = size
  else
    policy.type = rtt.globals.DATA
  end
  worked(deployer:connect(from, to, policy), what)
end

connect("hokuyo.scan", "switch.scan", nil, "connect hokuyo.scan and switch.scan")
connect("hokuyo.scan", "guidance.scan", nil, "connect hokuyo.scan and guidance.scan")
connect("hokuyo.scan", "gmapping.scan", nil, "connect hokuyo.scan and gmapping.scan")
connect("p3dx_driver.odometry", "pose.odometry", nil, "connect p3dx_driver.odometry and pose.odometry")
connect("p3dx_driver.odometry", "gmapping.odometry", nil, "connect p3dx_driver.odometry and gmapping.odometry")
connect("switch.command", "p3dx_driver.command", nil, "connect switch.command and p3dx_driver.command")
connect("gmapping.map", "exploration.map", nil, "connect gmapping.map and exploration.map")
connect("pose.pose", "exploration.pose", nil, "connect pose.pose and exploration.pose")
connect("exploration.goal", "navigation.goal", nil, "connect exploration.goal and navigation.goal")
connect("navigation.next", "control.target", nil, "connect navigation.next and control.target")
connect("control.command", "guidance.wanted", nil, "connect control.command and guidance.wanted")
connect("guidance.command", "switch.automatic", nil, "connect guidance.command and switch.automatic")
connect("teleop.command", "switch.manual", 4, "connect teleop.command and switch.manual")
connect("gmapping.correction", "pose.correction", nil, "connect gmapping.correction and pose.correction")
connect("gmapping.map", "navigation.map", nil, "connect gmapping.map and navigation.map")
connect("pose.pose", "navigation.pose", nil, "connect pose.pose and navigation.pose")
connect("pose.pose", "control.pose", nil, "connect pose.pose and control.pose")

-- How they run: period in seconds, priority, scheduler; and on which CPUs, a bit for each. Each
-- then looks whether its thread has that.
worked(deployer:setActivity("navigation", 1.0, 2, rtt.globals.ORO_SCHED_RT), "give navigation its activity")
worked(task("navigation"):setCpuAffinity(1), "give navigation its CPUs: are they all there?")
worked(task("navigation"):mauve_runs_as(2, 1), "start navigation")
worked(deployer:setActivity("control", 0.1, 5, rtt.globals.ORO_SCHED_RT), "give control its activity")
worked(task("control"):setCpuAffinity(1), "give control its CPUs: are they all there?")
worked(task("control"):mauve_runs_as(5, 1), "start control")
worked(deployer:setActivity("guidance", 0.1, 6, rtt.globals.ORO_SCHED_RT), "give guidance its activity")
worked(task("guidance"):setCpuAffinity(1), "give guidance its CPUs: are they all there?")
worked(task("guidance"):mauve_runs_as(6, 1), "start guidance")
worked(deployer:setActivity("switch", 0.1, 8, rtt.globals.ORO_SCHED_RT), "give switch its activity")
worked(task("switch"):setCpuAffinity(1), "give switch its CPUs: are they all there?")
worked(task("switch"):mauve_runs_as(8, 1), "start switch")
worked(deployer:setActivity("teleop", 0.1, 4, rtt.globals.ORO_SCHED_RT), "give teleop its activity")
worked(task("teleop"):setCpuAffinity(1), "give teleop its CPUs: are they all there?")
worked(task("teleop"):mauve_runs_as(4, 1), "start teleop")
worked(deployer:setActivity("pose", 0.1, 7, rtt.globals.ORO_SCHED_RT), "give pose its activity")
worked(task("pose"):setCpuAffinity(1), "give pose its CPUs: are they all there?")
worked(task("pose"):mauve_runs_as(7, 1), "start pose")
worked(deployer:setActivity("gmapping", 1.0, 3, rtt.globals.ORO_SCHED_RT), "give gmapping its activity")
worked(task("gmapping"):setCpuAffinity(2), "give gmapping its CPUs: are they all there?")
worked(task("gmapping"):mauve_runs_as(3, 2), "start gmapping")
worked(deployer:setActivity("p3dx_driver", 0.1, 10, rtt.globals.ORO_SCHED_RT), "give p3dx_driver its activity")
worked(task("p3dx_driver"):setCpuAffinity(1), "give p3dx_driver its CPUs: are they all there?")
worked(task("p3dx_driver"):mauve_runs_as(10, 1), "start p3dx_driver")
worked(deployer:setActivity("hokuyo", 0.1, 9, rtt.globals.ORO_SCHED_RT), "give hokuyo its activity")
worked(task("hokuyo"):setCpuAffinity(1), "give hokuyo its CPUs: are they all there?")
worked(task("hokuyo"):mauve_runs_as(9, 1), "start hokuyo")
-- In the background, and the model gives no period: it runs again 10 ms after it began, or when it
-- has ended. A `period` in its activity says another time.
worked(deployer:setActivity("exploration", 0.01, 0, rtt.globals.ORO_SCHED_OTHER), "give exploration its activity")
worked(deployer:setWaitPeriodPolicy("exploration", rtt.globals.ORO_WAIT_REL), "give exploration its activity")
worked(task("exploration"):mauve_runs_as(0, 0), "start exploration")

-- Outputs are topics, and inputs that nothing is connected to. On the other inputs a topic would
-- be a second writer.
local ros = rtt.provides("ros"):provides("comm")
worked(deployer:stream("navigation.next", ros:topic("navigation/next")), "make topic navigation/next: does roscore run?")
worked(deployer:stream("control.command", ros:topic("control/command")), "make topic control/command: does roscore run?")
worked(deployer:stream("guidance.command", ros:topic("guidance/command")), "make topic guidance/command: does roscore run?")
worked(deployer:stream("switch.command", ros:topic("switch/command")), "make topic switch/command: does roscore run?")
worked(deployer:stream("teleop.command", ros:topic("teleop/command")), "make topic teleop/command: does roscore run?")
worked(deployer:stream("pose.pose", ros:topic("pose/pose")), "make topic pose/pose: does roscore run?")
worked(deployer:stream("gmapping.map", ros:topic("gmapping/map")), "make topic gmapping/map: does roscore run?")
worked(deployer:stream("gmapping.correction", ros:topic("gmapping/correction")), "make topic gmapping/correction: does roscore run?")
worked(deployer:stream("p3dx_driver.odometry", ros:topic("p3dx_driver/odometry")), "make topic p3dx_driver/odometry: does roscore run?")
worked(deployer:stream("hokuyo.scan", ros:topic("hokuyo/scan")), "make topic hokuyo/scan: does roscore run?")
worked(deployer:stream("exploration.goal", ros:topic("exploration/goal")), "make topic exploration/goal: does roscore run?")
worked(deployer:stream("exploration.explored", ros:topic("exploration/explored")), "make topic exploration/explored: does roscore run?")
worked(deployer:stream("navigation.state", ros:topic("navigation/state")), "make topic navigation/state: does roscore run?")
worked(deployer:stream("navigation.period", ros:topic("navigation/period")), "make topic navigation/period: does roscore run?")
worked(deployer:stream("control.period", ros:topic("control/period")), "make topic control/period: does roscore run?")
worked(deployer:stream("guidance.state", ros:topic("guidance/state")), "make topic guidance/state: does roscore run?")
worked(deployer:stream("guidance.period", ros:topic("guidance/period")), "make topic guidance/period: does roscore run?")
worked(deployer:stream("switch.state", ros:topic("switch/state")), "make topic switch/state: does roscore run?")
worked(deployer:stream("switch.period", ros:topic("switch/period")), "make topic switch/period: does roscore run?")
worked(deployer:stream("teleop.state", ros:topic("teleop/state")), "make topic teleop/state: does roscore run?")
worked(deployer:stream("teleop.period", ros:topic("teleop/period")), "make topic teleop/period: does roscore run?")
worked(deployer:stream("pose.period", ros:topic("pose/period")), "make topic pose/period: does roscore run?")
worked(deployer:stream("gmapping.state", ros:topic("gmapping/state")), "make topic gmapping/state: does roscore run?")
worked(deployer:stream("gmapping.period", ros:topic("gmapping/period")), "make topic gmapping/period: does roscore run?")
worked(deployer:stream("p3dx_driver.period", ros:topic("p3dx_driver/period")), "make topic p3dx_driver/period: does roscore run?")
worked(deployer:stream("hokuyo.period", ros:topic("hokuyo/period")), "make topic hokuyo/period: does roscore run?")
worked(deployer:stream("exploration.state", ros:topic("exploration/state")), "make topic exploration/state: does roscore run?")
worked(deployer:stream("exploration.period", ros:topic("exploration/period")), "make topic exploration/period: does roscore run?")

-- Where all that has worked, all are configured.
worked(task("navigation"):configure(), "configure navigation")
worked(task("control"):configure(), "configure control")
worked(task("guidance"):configure(), "configure guidance")
worked(task("switch"):configure(), "configure switch")
worked(task("teleop"):configure(), "configure teleop")
worked(task("pose"):configure(), "configure pose")
worked(task("gmapping"):configure(), "configure gmapping")
worked(task("p3dx_driver"):configure(), "configure p3dx_driver")
worked(task("hokuyo"):configure(), "configure hokuyo")
worked(task("exploration"):configure(), "configure exploration")

-- They start, unless MAUVE_START is false: who provides operations before who requires them. Where
-- one does not start, all are stopped again.
local order = {
  "navigation",
  "control",
  "guidance",
  "switch",
  "teleop",
  "pose",
  "gmapping",
  "p3dx_driver",
  "hokuyo",
  "exploration",
}

local function stop(last)
  for index = last, 1, -1 do
    task(order[index]):stop()
  end
end

if os.getenv("MAUVE_START") ~= "false" then
  for index, name in ipairs(order) do
    if not task(name):start() then
      stop(index - 1)
      worked(false, "start " .. name)
    end
  end
end
