#pragma once
// Where an element touches its neighbours: the contact curves that drive its growth.
#include "pavel/vdb/contact_distance.h"
#include "pavel/vdb/element.h"

namespace pavel {

/// Finds the contact curves of all elements that have a body: where their placed surfaces meet the region taken by a
/// neighbour, or by the base when they touch no other. Fills `contacts` and `contact`. Equal on any number of threads.
void findContacts(std::vector<WorkElement>& elements, const openvdb::FloatTree* base);

}  // namespace pavel
