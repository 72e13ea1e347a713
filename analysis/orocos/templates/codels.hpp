// {generated}
//
// The prototypes of the library's codels. You write their definitions in src/codels.

#pragma once

#include <{lib}/{lib}-types.hpp>

namespace {lib} {

{codels}

}  // namespace {lib}
