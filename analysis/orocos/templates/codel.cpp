{stub}
//
// {about}
{words}

#include <{lib}/{lib}-codels.hpp>

namespace {lib} {

{head}
  // TODO: write this codel. Until then, its results are zero or empty. It must not wait, for a device, a lock,
  // another thread or a sleep, unless [wait] or [locks] say so: no response time counts it otherwise.
{results}
}

}  // namespace {lib}
