#include <cfloat>
#include <cstdio>
#ifndef @UP@_REAL
#define @UP@_REAL double
#endif
using namespace @title@_kinematics;
using std::fabs;
using std::printf;
typedef @UP@_REAL real;
#define R(x) (static_cast<real>(x))
