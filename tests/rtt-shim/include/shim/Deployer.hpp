// What the deployer of a real system does, for tests: it loads component libraries and connects operations of different names.

#ifndef SHIM_DEPLOYER_HPP
#define SHIM_DEPLOYER_HPP

#include <dlfcn.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "rtt/TaskContext.hpp"

namespace shim {

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

class Deployer {
 public:
  // Connects what `requirer` calls `required` to what `provider` calls `provided`. False where one of them is not there, or
  // their signatures differ.
  static bool connect_operations(RTT::TaskContext& provider, const std::string& provided,
                                 RTT::TaskContext& requirer, const std::string& required) {
    const auto operation = provider.provided_->operations_.find(provided);
    if (operation == provider.provided_->operations_.end()) return false;
    return requirer.required_->connect(required, operation->second->part());
  }
};

}  // namespace shim

#endif
