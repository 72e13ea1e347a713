#ifndef MAUVE_RTT_COMPONENT_HPP
#define MAUVE_RTT_COMPONENT_HPP

#include <map>
#include <string>
#include <vector>

#include "rtt/TaskContext.hpp"

#ifndef RTT_COMPONENT
#warning "a component library is compiled with -DRTT_COMPONENT, or nothing can load it"
#endif

#ifdef __clang__
#pragma clang diagnostic ignored "-Wreturn-type-c-linkage"
#endif

namespace RTT {

typedef TaskContext* (*ComponentLoaderSignature)(std::string instance_name);
typedef std::map<std::string, ComponentLoaderSignature> FactoryMap;

// The components of one library: each library has its own, which nothing outside sees.
class ComponentFactories {
 public:
  __attribute__((visibility("hidden"))) static FactoryMap& Instance() {
    if (factories == nullptr) factories = new FactoryMap();
    return *factories;
  }

 private:
  // The macro for a library defines it: a library without that does not link.
  __attribute__((visibility("hidden"))) static FactoryMap* factories;
};

template <class C>
class ComponentFactoryLoader {
 public:
  __attribute__((visibility("hidden"))) explicit ComponentFactoryLoader(const std::string& type_name) {
    ComponentFactories::Instance()[type_name] = &create;
  }

 private:
  static TaskContext* create(std::string instance_name) { return new C(instance_name); }
};

}  // namespace RTT

#define MAUVE_RTT_TEXT2(x) #x
#define MAUVE_RTT_TEXT(x) MAUVE_RTT_TEXT2(x)
#define MAUVE_RTT_JOIN2(x, y) x##y
#define MAUVE_RTT_JOIN(x, y) MAUVE_RTT_JOIN2(x, y)

// The one component of a library.
#define ORO_CREATE_COMPONENT(CNAME)                                                                       \
  extern "C" __attribute__((visibility("default"))) RTT::TaskContext* createComponent(std::string name);  \
  RTT::TaskContext* createComponent(std::string name) { return new CNAME(name); }                         \
  extern "C" __attribute__((visibility("default"))) std::string getComponentType();                       \
  std::string getComponentType() { return MAUVE_RTT_TEXT(CNAME); }

// One of the components of a library, at the end of its own file. Files that are compiled as one may have it on the same line.
#define ORO_LIST_COMPONENT_TYPE(CNAME)                                                                \
  namespace {                                                                                         \
  namespace MAUVE_RTT_JOIN(LOADER_, __COUNTER__) {                                                     \
    RTT::ComponentFactoryLoader<CNAME> m_cloader(MAUVE_RTT_TEXT(CNAME));                               \
  }                                                                                                   \
  }

// Once in a library with several components.
#define ORO_CREATE_COMPONENT_LIBRARY()                                                                    \
  RTT::FactoryMap* RTT::ComponentFactories::factories = nullptr;                                          \
  extern "C" __attribute__((visibility("default"))) RTT::TaskContext* createComponentType(                \
      std::string name, std::string type);                                                                \
  RTT::TaskContext* createComponentType(std::string name, std::string type) {                             \
    const RTT::FactoryMap& factories = RTT::ComponentFactories::Instance();                               \
    const RTT::FactoryMap::const_iterator found = factories.find(type);                                   \
    return found == factories.end() ? nullptr : found->second(name);                                      \
  }                                                                                                       \
  extern "C" __attribute__((visibility("default"))) std::vector<std::string> getComponentTypeNames();     \
  std::vector<std::string> getComponentTypeNames() {                                                      \
    std::vector<std::string> names;                                                                       \
    for (const auto& factory : RTT::ComponentFactories::Instance()) names.push_back(factory.first);       \
    return names;                                                                                         \
  }

#endif
