// What the deployer of a real system does, for tests: it loads component libraries.

#ifndef RIG_LIBRARY_HPP
#define RIG_LIBRARY_HPP

#include <dlfcn.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <rtt/TaskContext.hpp>

namespace rig {

// A component library, which stays loaded: `-ldl` is needed.
class ComponentLibrary {
 public:
  explicit ComponentLibrary(const std::string& path) : library_(dlopen(path.c_str(), RTLD_NOW)) {
    if (library_ == nullptr) throw std::runtime_error(dlerror());
  }

  // The types of its components, as they are written in it: `::motion::Pilot`.
  std::vector<std::string> types() const {
    if (const auto names = function<std::vector<std::string>()>("getComponentTypeNames")) return names();
    if (const auto name = function<std::string()>("getComponentType")) return {name()};
    throw std::runtime_error("no component library");
  }

  std::unique_ptr<RTT::TaskContext> create(const std::string& type, const std::string& instance) const {
    RTT::TaskContext* task = nullptr;
    if (const auto create = function<RTT::TaskContext*(std::string, std::string)>("createComponentType")) {
      task = create(instance, type);
    } else if (types().front() == type) {
      task = function<RTT::TaskContext*(std::string)>("createComponent")(instance);
    }
    if (task == nullptr) throw std::runtime_error("no component " + type);
    return std::unique_ptr<RTT::TaskContext>(task);
  }

 private:
  template <class Signature>
  Signature* function(const char* name) const {
    return reinterpret_cast<Signature*>(dlsym(library_, name));
  }

  void* const library_;
};

}  // namespace rig

#endif
