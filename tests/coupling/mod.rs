mod blocks;
mod pressing;
mod small_joint;
mod truth;
