#!/bin/bash
# Shows how much of each store is there, by what lies on the disk: Slurm's word that a job is done is not taken for it.
# Ends with 0 only if all stores are there. Pyramids are not looked at: btf verify NAME.dzi does that.
case $0 in */*) cd -- "${0%/*}" ;; esac
. ./settings.sh
