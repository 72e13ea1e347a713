// {generated}
//
{description}

#include <mauve/robot.hpp>
@if topics
#include <mauve/ros2.hpp>
@end
@if headers
{headers}
@end

int main(int argc, char** argv) {
  mauve::Robot robot({deployment});

  // Creates the instances; a provider of operations comes before the instances that call it.
{instances}
@if values

  // Sets values of the model, and values that depend on them.
{values}
@end
@if connections

  // Connects outputs to inputs. An input keeps the last value, or as many values as its buffer has.
{connections}
@end
@if operations

  // Connects the operations: required operation, provided operation.
{operations}
@end

  // Creates the activities: period in ns, priority (0: background), CPUs (one bit for each; 0: any),
  // offset, deadline and response time in ns.
{activities}
@if topics

  // Moves samples between ports and topics of ROS 2: period and priority of the gateway, CPUs, deadline and response time.
{gateway}
  // Each port with its instance and name, topic, type and its hash, depth, reliable, transient local, greatest size.
{topics}
@end
@if others

  // Real-time work that is not in the model: period and execution time in ns, priority, CPUs.
{others}
@end
@if chains

  // The chains whose latency is observed: bound and limit in ns, and where data enters and leaves each
  // instance.
{chains}
@end
@if times

{level}
{times}
@end
@if unknown

{unknown}
@end

  return robot.run(argc, argv);
}
