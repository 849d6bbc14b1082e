cd /tmp/m
for n in wood leather; do ./btf0 -q sample $n.zip --material $n --size 800x800 --views 9 --lights 15 && ./btf0 -q import $n.zip $n.zarr; ./btf0 -q model $n.zarr --tile 224x224; done
