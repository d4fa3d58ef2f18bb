#!/bin/sh
# Starting inputs for the fuzz targets: a tetrahedron in each format. Without them a fuzzer takes long to find the headers.
set -eu
cd "$(dirname "$0")"
mkdir -p corpus/obj corpus/stl corpus/ply corpus/off corpus/gltf corpus/scene corpus/control

printf 'o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1/1 2/2/2 4//4\nf -3 -2 -1\nf 3 1 4\n' > corpus/obj/tetrahedron
printf 'v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n' > corpus/obj/pentagon
printf 'OFF\n5 2 0\n0 0 0\n4 0 0\n4 4 0\n2 1 0\n0 4 0\n5 0 1 2 3 4\n3 0 1 2\n' > corpus/off/pentagon
printf 'solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n' > corpus/stl/ascii
{ printf '%80s' ''; printf '\001\0\0\0'; printf '%12s' ''; printf '\0\0\200\077%.0s' 1 2 3 4 5 6 7 8 9; printf '\0\0'; } > corpus/stl/binary
printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0\n3 0 1 2\n' > corpus/ply/ascii
{ printf 'ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty char y\nproperty char z\nelement face 1\nproperty list uchar uchar vertex_index\nend_header\n'; printf '\0\0\0\001\0\0\0\001\0\003\0\001\002'; } > corpus/ply/binary
printf '{"asset":{"version":"2.0"},"nodes":[{"mesh":0,"scale":[1,2,-1]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":5}]}],"accessors":[{"bufferView":0,"componentType":5120,"count":3,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":0,"componentType":5121},"values":{"bufferView":0}}}],"bufferViews":[{"buffer":0,"byteLength":9,"byteStride":3}],"buffers":[{"byteLength":9,"uri":"data:;base64,AAAAAQAAAAEA"}]}' > corpus/gltf/json
printf '[body]\nsurface = "skin.ply"\nunit = "mm"\n[[layer]]\ntissue = "fat"\nthickness = "20 mm"\n' > corpus/scene/small
printf '{"id":1,"type":"hand","point":[0.1,0,0.02],"normal":[0,0,1],"depth":0.004}' > corpus/control/hand
printf '{"type":"edit","edits":[{"path":"/layer/0/tissue/young","value":"12 kPa"}]}' > corpus/control/edit
