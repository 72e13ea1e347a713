{stub}
//
// {about}
{words}

#include <{lib}/{lib}-codels.hpp>

namespace {lib} {

{head}
  // TODO: write this codel. Until then, its results are zero or empty.
{results}
}

}  // namespace {lib}
