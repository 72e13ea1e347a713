// {mark}: do not change this file.
//
// Calls codels alone, with the inputs that `mauve measure` was given.

#include <deque>
#include <limits>
#include <string>

#include <mauve/execution.hpp>
#include <mauve/measure.hpp>

{headers}

{functions}

static void measure(mauve::Measurement& measurement) {
{calls}
}

int main(int argc, char** argv) { return mauve::measure(argc, argv, &measure); }
