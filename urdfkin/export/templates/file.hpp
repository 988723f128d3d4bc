@head@
#ifndef @UP@_HPP
#define @UP@_HPP
#include <cmath>
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || defined(__RECIPROCAL_MATH__)
#error "-ffast-math reorders sums and rounds sines more; the error bounds of this file do not allow for it"
#endif

namespace @title@_kinematics {
@functions@
} // namespace @title@_kinematics

#ifdef @UP@_MAIN
@start@
@main@
#endif
#endif
