// What the sample robot names of hokuyo_node, so that its code compiles where that is not installed.
#ifndef HOKUYO_STAND_IN_H
#define HOKUYO_STAND_IN_H
namespace hokuyo {
class Laser;
}
#endif
