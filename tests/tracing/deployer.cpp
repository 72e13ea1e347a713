// Runs both components, each in its thread, until a line comes in. The arguments are their libraries. None is in real time:
// something else preempts them.

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>

#include <dlfcn.h>

#include <rtt/Activity.hpp>
#include <rtt/InputPort.hpp>
#include <rtt/OutputPort.hpp>
#include <rtt/TaskContext.hpp>

#include "../orocos/rig/main.hpp"

// The component of a library that has one.
static std::unique_ptr<RTT::TaskContext> create(const char* library, const std::string& instance) {
  void* const loaded = dlopen(library, RTLD_NOW | RTLD_GLOBAL);
  void* const create = loaded == nullptr ? nullptr : dlsym(loaded, "createComponent");
  if (create == nullptr) {
    std::cerr << dlerror() << std::endl;
    std::exit(1);
  }
  const auto component = reinterpret_cast<RTT::TaskContext* (*)(std::string)>(create)(instance);
  return std::unique_ptr<RTT::TaskContext>(component);
}

int ORO_main(int, char** arguments) {
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  const auto source = create(arguments[1], "source");
  const auto pilot = create(arguments[2], "pilot");
  source->setActivity(new RTT::Activity(ORO_SCHED_OTHER, 0, 0.06, 0x1u, nullptr, "source"));
  pilot->setActivity(new RTT::Activity(ORO_SCHED_OTHER, 0, 0.02, 0x1u, nullptr, "pilot"));
  bool fine = source->getPort("value")->connectTo(pilot->getPort("value"), RTT::ConnPolicy::data());
  fine = fine && pilot->requires()->connectTo(source->provides());
  for (const auto& task : {source.get(), pilot.get()}) fine = fine && task->configure() && task->start();
  std::string line;
  std::getline(std::cin, line);
  for (const auto& task : {source.get(), pilot.get()}) fine = fine && task->stop() && task->cleanup();
  return fine ? 0 : 1;
}
