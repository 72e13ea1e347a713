// What the sample robot names of GMapping, so that its code compiles where that is not installed.
#ifndef GMAPPING_STAND_IN_H
#define GMAPPING_STAND_IN_H
namespace GMapping {
class GridSlamProcessor;
}
#endif
