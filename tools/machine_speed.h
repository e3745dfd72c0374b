#pragma once

namespace pavel {

/// How fast this machine packs, next to the one that the figures of forecasts come from: above 1 where it is faster.
/// Packs two pearls, in half a second or so.
double machineSpeed();

}  // namespace pavel
