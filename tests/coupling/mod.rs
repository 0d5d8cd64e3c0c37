mod blocks;
mod pressing;
mod truth;
