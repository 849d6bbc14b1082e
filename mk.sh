cd /tmp/m
D=/work/shared/data
for n in corduroy impalla wallpaper; do ./btf0 -q import $D/mlvq-btf/$n $n.zarr; done
./btf0 -q import $D/virtual-leather/VLEATHER64.zip vleather.zarr
for n in corduroy impalla wallpaper; do nice ./btf0 -q model $n.zarr; done
./btf0 -q model vleather.zarr --tile periodic
ls
