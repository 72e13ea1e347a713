// What the sample robot names of ARIA, so that its code compiles where ARIA is not installed.
#ifndef ARIA_STAND_IN_H
#define ARIA_STAND_IN_H
class ArRobot;
class ArRobotConnector;
#endif
