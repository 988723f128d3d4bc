% Replaces the class of the Robotics System Toolbox without MATLAB.
% This class follows the documentation of the toolbox.
classdef rigidBodyTree < handle
    properties
        BaseName = 'base';
        Bodies = {};
        Parents = {};
    end
    methods
        function self = rigidBodyTree(varargin)
        end
        function addBody(self, body, parent)
            self.Bodies{end + 1} = body;
            self.Parents{end + 1} = parent;
        end
        function T = getTransform(self, q, name)
            k = 0;
            poses = containers.Map();
            poses(self.BaseName) = eye(4);
            for i = 1:numel(self.Bodies)
                body = self.Bodies{i};
                value = 0;
                if ~strcmp(body.Joint.Type, 'fixed')
                    k = k + 1;
                    value = q(k);
                end
                poses(body.Name) = poses(self.Parents{i}) * body.Joint.Fixed * moved(body.Joint, value);
            end
            T = poses(name);
        end
    end
end

function T = moved(joint, value)
    T = eye(4);
    z = joint.JointAxis(3);
    if strcmp(joint.Type, 'prismatic')
        T(3, 4) = z * value;
    else
        T(1:2, 1:2) = [cos(z * value), -sin(z * value); sin(z * value), cos(z * value)];
    end
end
