// {generated}
//
// The entry point through which the deployer loads the components of this library.

#include <rtt/Component.hpp>

ORO_CREATE_COMPONENT_LIBRARY()
