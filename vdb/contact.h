#pragma once
// Where an element touches its neighbours: the contact curves that drive its growth.
#include "pavel/vdb/contact_distance.h"
#include "pavel/vdb/element.h"

namespace pavel {

/// Finds the contact curves of one element: where its placed surface meets the region taken by a neighbour, or by the
/// base when it touches no other. Fills `contacts` and `contact`.
void findContacts(WorkElement& element, const std::vector<WorkElement>& all, const openvdb::FloatTree* base);

}  // namespace pavel
