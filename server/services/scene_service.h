// Methods of SceneService over a host: scenes, meshes, instances, dumps. Each method checks its request, calls the core
// and converts the result; the longer ones are implemented in files of their own. Functions without state; any thread.
#ifndef LOCUS_SERVER_SERVICES_SCENE_SERVICE_H_
#define LOCUS_SERVER_SERVICES_SCENE_SERVICE_H_

#include <vector>

#include "server/host/host.h"
#include "server/rpc/blocking_method.h"

namespace locus::server {

// Returns the methods of locus.v1.SceneService over `host`, which must outlive them.
std::vector<BlockingMethod> scene_methods(Host& host);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SCENE_SERVICE_H_
