-- {generated}
{description}

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

-- Next to the source folder of a package, the deployer takes that folder for the installed package:
-- the second path names the installed one.
local function import(package)
  local is_there = deployer:import(package) or deployer:import("gnulinux/" .. package)
  worked(is_there, "import package " .. package .. ": build it, and source its workspace")
end

local function load(name, class)
  local is_loaded = deployer:loadComponent(name, class)
  worked(is_loaded, "load " .. name .. ", a " .. class .. ": rebuild its package")
end

local function task(name)
  return assert(deployer:getPeer(name), "there is no " .. name)
end

local function set(name, property, value)
  local is_set, why = pcall(function() task(name):getProperty(property):set(value) end)
  worked(is_set, "set " .. property .. " of " .. name .. ": " .. tostring(why))
end
@if ros

-- Imports ROS and the types of the messages.
-- Topics need rtt_ros_integration. Without them: `[generate] ros_streams = false` in mauve.toml.
{ros}
@end

-- Creates the components.
{packages}

-- Creates the instances; a provider of operations comes before the instances that call it. The
-- deployer stops them in reverse order.
{instances}
@if set

-- Sets values of the model, and values that depend on them.
{set}
@end
@if read

-- Reads property values of this launch: NAME.cpf in the folder MAUVE_VALUES, for each instance
-- with properties.
local values = os.getenv("MAUVE_VALUES") or ""

local function read(name)
  local what = "use the values in " .. name .. ".cpf"
  worked(deployer:loadService(name, "marshalling"), what)
  if values ~= "" then
    local marshalling = task(name):provides("marshalling")
    worked(marshalling:updateProperties(values .. "/" .. name .. ".cpf"), what)
  end
end

{read}
@end
@if triggers

-- Names the inputs whose data release their instances, with the gap between releases in seconds, and the
-- releases in that time. A port that becomes an event port loses its connections, so this comes first.
{triggers}
@end
@if connections

-- Connects outputs to inputs. An input keeps the last value, or as many values as its buffer has.
local function connect(from, to, size, what)
  local policy = rtt.Variable("ConnPolicy")
  if size then
    policy.type = rtt.globals.CIRCULAR_BUFFER
    policy.size = size
  else
    policy.type = rtt.globals.DATA
  end
  worked(deployer:connect(from, to, policy), what)
  if size then
    -- The component clears the buffer when it starts.
    local name, port = to:match("([^.]*)%.(.*)")
    worked(task(name):mauve_has_buffer(port), what)
  end
end

{connections}
@end
@if operations

-- Connects the operations: required operation, provided operation.
{operations}
@end

-- Creates the activities: period in seconds, priority, scheduler, and CPUs, one bit for each. Each
-- component then checks its thread.
{activities}
@if streams

-- Streams outputs, and inputs without a connection, to topics. On a connected input, a topic would
-- be a second writer.
@if topics
local ros = rtt.provides("ros"):provides("comm")
@end
{streams}
@end

-- If all steps succeeded, configures the instances.
{configured}

-- Starts the instances, providers of operations first, unless MAUVE_START is false. If one fails
-- to start, all are stopped again.
local order = {
{order}
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
