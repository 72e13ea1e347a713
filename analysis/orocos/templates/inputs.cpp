// {mark}: do not change this file.
//
// Records inputs of codels.

#include <mauve/inputs.hpp>

{headers}

{functions}
